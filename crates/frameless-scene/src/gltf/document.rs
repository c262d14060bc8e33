//! What the readers of meshes, materials and animations share.

use std::path::Path;

use super::accessor::Accessor;
use super::buffers::View;
use super::json::Json;
use super::limits::Budget;
use super::warnings::Warnings;

/// A parsed document with its binary data, and what was found out about it so far.
pub(super) struct Document<'a> {
    pub(super) root: Json<'a>,
    pub(super) views: Vec<View<'a>>,
    pub(super) accessors: Vec<Accessor<'a>>,
    /// Where relative URIs lead; `None`: nowhere.
    pub(super) folder: Option<&'a Path>,
    pub(super) budget: Budget,
    pub(super) warnings: Warnings,
}

//! Which part of the picture a client is sent next, how it is written, and how much may be on its way.

mod atlas;
mod codec;
mod flow;
mod grid;
mod publish;
mod seen;
mod smooth;
#[cfg(test)]
mod traffic;

pub(crate) use atlas::Atlas;
pub(crate) use codec::encode;
pub(crate) use flow::Flow;
pub(crate) use grid::{Grid, SIDE};
pub(crate) use publish::{Occasion, Published, Publisher, Taken};
pub(crate) use seen::{Seen, Times};
use smooth::Mean;

#[cfg(test)]
pub(crate) use publish::tests::{picture, published};

//! Stages that an experiment can leave out, to see what each of them buys.

/// A stage of [`Adaptive`](super::Adaptive).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AdaptiveStage {
    /// Fronts: without, neighbours of a change wait for their tile's turn.
    Fronts,
    /// Holes first: without, pixels that wait ([`Canvas::holes`](crate::Canvas::holes)) take their tile's turn like all others.
    Holes,
    /// Late looks: without, edges of moving shadows are found like any other change.
    Late,
    /// Learned rates: without, all tiles get the same share instead of one by √v.
    Rates,
    /// Bayer's order inside a tile: without, each pixel is drawn at random.
    Bayer,
}

impl AdaptiveStage {
    /// All, in the order in which a batch is filled.
    pub const ALL: [AdaptiveStage; 5] = [
        AdaptiveStage::Holes,
        AdaptiveStage::Fronts,
        AdaptiveStage::Late,
        AdaptiveStage::Rates,
        AdaptiveStage::Bayer,
    ];

    /// As in `adaptive(without=fronts)`.
    pub fn name(self) -> &'static str {
        match self {
            AdaptiveStage::Fronts => "fronts",
            AdaptiveStage::Holes => "holes",
            AdaptiveStage::Late => "late",
            AdaptiveStage::Rates => "rates",
            AdaptiveStage::Bayer => "bayer",
        }
    }

    /// The stage of that name.
    pub fn from_name(name: &str) -> Option<AdaptiveStage> {
        AdaptiveStage::ALL.into_iter().find(|stage| stage.name() == name)
    }
}

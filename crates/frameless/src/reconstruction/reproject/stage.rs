//! Stages that an experiment can leave out, to see what each of them buys.

/// A stage of [`Reproject`](super::Reproject).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReprojectStage {
    /// Aiming: without, every ray goes through its pixel's centre, wherever its hit will be by the next refresh.
    Aim,
    /// Range of colours: without, the residual of moving surfaces is the raw difference, as that of surfaces at rest.
    Range,
    /// Taking away what is seen through cracks between a nearer object's samples.
    Cracks,
    /// Taking away what something nearer has come before.
    Covers,
    /// Means: without, a pixel shows its own best sample as it is. Holes are filled as ever.
    Gather,
    /// Tracing pixels again that samples beside their centres show, once nothing moves.
    Recentre,
    /// Borrowing: without, pixels at rest of a renderer with noise show their own means, however few samples these are of.
    Borrow,
}

impl ReprojectStage {
    /// All, in the order of the data.
    pub const ALL: [ReprojectStage; 7] = [
        ReprojectStage::Aim,
        ReprojectStage::Range,
        ReprojectStage::Cracks,
        ReprojectStage::Covers,
        ReprojectStage::Gather,
        ReprojectStage::Recentre,
        ReprojectStage::Borrow,
    ];

    /// As in `reproject(without=aim)`.
    pub fn name(self) -> &'static str {
        match self {
            ReprojectStage::Aim => "aim",
            ReprojectStage::Range => "range",
            ReprojectStage::Cracks => "cracks",
            ReprojectStage::Covers => "covers",
            ReprojectStage::Gather => "gather",
            ReprojectStage::Recentre => "recentre",
            ReprojectStage::Borrow => "borrow",
        }
    }

    /// The stage of that name.
    pub fn from_name(name: &str) -> Option<ReprojectStage> {
        ReprojectStage::ALL.into_iter().find(|stage| stage.name() == name)
    }
}

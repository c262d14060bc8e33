//! How light is followed: `--integrator` and what goes with it.

use anyhow::anyhow;
use clap::Args as ClapArgs;
use clap::builder::PossibleValuesParser;
use frameless_trace::{Integrator, Lens, Settings};

use crate::failure::Failure;
use crate::parse;

/// How light is followed.
#[derive(ClapArgs)]
pub(crate) struct LightArgs {
    /// How light is followed
    ///
    /// direct: lights seen directly and in mirrors, with hard shadows; without noise. path: light that has bounced any number of
    /// times, by random paths; noise goes away where the picture rests.
    #[arg(long, value_name = "NAME", default_value = "direct", value_parser = integrator_names())]
    pub(crate) integrator: String,

    /// After how many surfaces a path of light ends
    #[arg(long, value_name = "N", default_value_t = Settings::default().max_depth)]
    #[arg(value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub(crate) max_depth: u32,

    /// Blur what is not in focus: the diameter of the lens, in metres; needs --integrator path
    #[arg(long, value_name = "METRES", value_parser = parse::positive, requires = "focus")]
    pub(crate) aperture: Option<f64>,

    /// How far away what is sharp is, in metres along the direction of view; `frameless trace` tells it of any pixel
    #[arg(long, value_name = "METRES", value_parser = parse::positive, requires = "aperture")]
    pub(crate) focus: Option<f64>,
}

impl Default for LightArgs {
    fn default() -> LightArgs {
        let Settings { integrator, max_depth, .. } = Settings::default();
        LightArgs {
            integrator: integrator.name().to_owned(),
            max_depth,
            aperture: None,
            focus: None,
        }
    }
}

impl LightArgs {
    /// How samples are to be traced.
    pub(crate) fn settings(&self) -> Result<Settings, Failure> {
        let integrator = Integrator::from_name(&self.integrator).unwrap_or_default();
        let lens = self.aperture.zip(self.focus).map(|(aperture, focus)| Lens {
            radius_m: (0.5 * aperture) as f32,
            focus_m: focus as f32,
        });
        if lens.is_some() && integrator != Integrator::Path {
            let name = integrator.name();
            return Err(Failure::bad_input(anyhow!(
                "--aperture is for the integrator path; {name} has no lens"
            )));
        }
        Ok(Settings { integrator, max_depth: self.max_depth, lens, ..Settings::default() })
    }
}

fn integrator_names() -> PossibleValuesParser {
    PossibleValuesParser::new(Integrator::ALL.map(Integrator::name))
}

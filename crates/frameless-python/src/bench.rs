//! The loop without Python, to be compared with.

use frameless::{Answer, Clock, Engine, Time};
use pyo3::prelude::*;

use crate::arguments::{reconstruction_kind, sampler_kind};
use crate::outside::Outside;
use crate::shared::{Length, State};
use crate::size::PictureSize;

/// What a session does with answers that cost nothing, for so many seconds: samples kept, and seconds.
#[pyfunction]
pub(crate) fn loop_without_python(
    py: Python<'_>,
    size: PictureSize,
    sampler: &str,
    reconstruction: &str,
    batch: usize,
    seconds: f64,
) -> PyResult<(u64, f64)> {
    let (sampler, reconstruction) = (sampler_kind(sampler)?, reconstruction_kind(reconstruction)?);
    let outside = Outside::new(None, false);
    let mut engine = Engine::new(size.0, Clock::real(), sampler.build(1), outside);
    engine.set_reconstruction(reconstruction.build());
    let mut state = State::new(engine, Length::Fixed(batch));
    let end = Time::from_secs(seconds);
    py.detach(move || {
        while state.engine.now() < end {
            state.refresh_if_due();
            let asked = state.engine.choose(state.length.next_length());
            let rgb = vec![[0.5; 3]; asked.requests.len()];
            let answer = Answer::to(asked, rgb, Vec::new());
            // Finite, and of this size: nothing can be wrong with it.
            state.engine.answer(answer).ok();
            state.note_changes();
        }
        Ok((state.engine.counters().kept, state.engine.now().secs()))
    })
}

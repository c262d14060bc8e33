//! A renderer for tests: one colour per world.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use frameless::{Answer, Batch, Tracer};
use frameless_scene::View;

use crate::command::ViewChoice;
use crate::session::{Stage, Steering};

/// Every pixel is this grey, or every other column black; remembers where it is to look from.
pub(crate) struct Plain {
    pub grey: f32,
    pub striped: bool,
    pub view: ViewChoice,
    /// Where it was steered to last, past the loop.
    pub steered: Arc<Mutex<Option<View>>>,
    answers: VecDeque<Answer>,
}

impl Plain {
    pub(crate) fn new(grey: f32) -> Plain {
        let (view, steered) = (ViewChoice::Camera(0), Arc::default());
        Plain { grey, striped: false, view, steered, answers: VecDeque::new() }
    }
}

impl Tracer for Plain {
    /// # Panics
    /// If the grey is negative.
    fn submit(&mut self, batch: Batch) {
        assert!(self.grey.is_nan() || self.grey >= 0.0, "a renderer that panics on purpose");
        let grey = |pixel| match self.striped && batch.size.xy(pixel).0 % 2 == 1 {
            true => [0.0; 3],
            false => [self.grey; 3],
        };
        let rgb = batch.requests.iter().map(|request| grey(request.pixel)).collect();
        self.answers.push_back(Answer::to(batch, rgb, Vec::new()));
    }

    fn collect(&mut self, _wait: bool) -> Option<Answer> {
        self.answers.pop_front()
    }
}

impl Stage for Plain {
    type World = f32;

    fn set_view(&mut self, view: ViewChoice) {
        self.view = view;
    }

    fn steering(&self) -> Option<Steering> {
        let steered = Arc::clone(&self.steered);
        Some(Box::new(move |view| *steered.lock().unwrap() = Some(view)))
    }

    fn set_world(&mut self, grey: f32) {
        self.grey = grey;
    }
}

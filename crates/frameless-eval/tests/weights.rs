//! Image-quality weights: the error falls where somebody looks or the caller says that it counts, and rises elsewhere.

use std::path::Path;

use frameless::{
    Answer, Canvas, Clock, Engine, Gaze, ReconstructionKind, Request, SamplerKind, Size, Time,
    Weights,
};
use frameless_eval::{Experiment, Ideals, Subject, refresh_time, rmse_where};

/// Refreshes that are not scored.
const UNSCORED: usize = 15;
/// 7.6 % of the pixels per refresh, as in the suite at 900,000.
const SAMPLES_PER_PIXEL_SEC: f64 = 900_000.0 / (512.0 * 384.0);

struct Stage {
    scene: &'static str,
    size: Size,
    subject: Subject,
    ideals: Ideals,
}

/// Root of the mean squared error inside a region and outside.
type Errors = [f64; 2];

impl Stage {
    fn new(scene: &'static str, size: Size, secs: f64) -> Stage {
        let Size { width, height } = size;
        let text = format!(
            "title = \"weights\"\nsamples_per_sec = [1]\nwidth = {width}\nheight = {height}\nduration_secs = {secs}\n\
             unscored_secs = 0.25\n[[scenes]]\nscene = \"{scene}\"\n[output]\nvideo = false"
        );
        let experiment = Experiment::parse(&text, Path::new("")).expect("valid");
        let subject = Subject::load(&experiment.scenes[0]).expect("built in");
        let ideals = Ideals::trace(&subject, &experiment, &|| (), &|| false).expect("not stopped");
        Stage { scene, size, subject, ideals }
    }

    /// Over three seeds: what the weights bring is of the size of what one seed differs from another.
    fn errors(&self, weights: &Weights, region: &[bool]) -> Errors {
        let seeds = [1, 2, 3].map(|seed| self.errors_of_seed(weights, region, seed));
        [0, 1].map(|i| (seeds.iter().map(|of_seed| of_seed[i].powi(2)).sum::<f64>() / 3.0).sqrt())
    }

    fn errors_of_seed(&self, weights: &Weights, region: &[bool], seed: u64) -> Errors {
        let size = self.size;
        let mut engine = Engine::with_canvas(
            Canvas::from_picture(size, self.ideals.start.clone()),
            Clock::simulated(SAMPLES_PER_PIXEL_SEC * size.pixels() as f64),
            SamplerKind::ADAPTIVE.build(seed),
            self.subject.tracer(true),
        );
        engine.set_reconstruction(ReconstructionKind::REPROJECT.build());
        engine.set_weights(weights);
        let requests: Vec<Request> = (0..size.pixels() as u32).map(Request::centre).collect();
        let (rgb, surfaces) = self.subject.trace_surfaces(0.0, size, &requests);
        let now = Time::ZERO;
        let start = Answer { batch: 0, now, scene_secs: 0.0, size, requests, rgb, surfaces };
        engine.start_with(&start).expect("finite colours");
        let outside: Vec<bool> = region.iter().map(|inside| !inside).collect();
        let mut squares = [0.0; 2];
        for (k, ideal) in self.ideals.pictures.iter().enumerate() {
            let time = refresh_time(k, 60);
            engine.run_until(time).expect("finite colours");
            let picture = engine.refresh(time);
            let both = [region, &outside].map(|part| rmse_where(part, ideal, picture));
            (0..2).filter(|_| k >= UNSCORED).for_each(|i| {
                squares[i] += both[i].expect("pixels").powi(2);
            });
        }
        squares.map(|sum| (sum / (self.ideals.pictures.len() - UNSCORED) as f64).sqrt())
    }

    /// Which pixels' centres are inside.
    fn region(&self, inside: impl Fn(f32, f32) -> bool) -> Vec<bool> {
        let pixels = (0..self.size.pixels() as u32).map(|pixel| self.size.xy(pixel));
        pixels.map(|(x, y)| inside(x as f32 + 0.5, y as f32 + 0.5)).collect()
    }

    /// Errors with the weights over those without.
    fn compare(&self, what: &str, weights: &Weights, region: &[bool]) -> Errors {
        let plain = self.errors(&Weights::default(), region);
        let weighted = self.errors(weights, region);
        let [inside, outside] = [0, 1].map(|i| {
            format!("{:.4} → {:.4} ({:.3})", plain[i], weighted[i], weighted[i] / plain[i])
        });
        println!("{}, {what}: inside {inside}, outside {outside}", self.scene);
        [0, 1].map(|i| weighted[i] / plain[i])
    }

    fn gaze(&self, strength: f32) -> Errors {
        let Size { width, height } = self.size;
        let (x, y, radius_px) =
            (0.5 * width as f32, 0.5 * height as f32, Gaze::RADIUS * height as f32);
        let fovea = self.region(|px, py| (px - x).hypot(py - y) < radius_px);
        let gaze = Gaze { at: [0.5; 2], radius: Gaze::RADIUS, strength };
        let weights = Weights::default().with_gaze(gaze).expect("valid");
        self.compare(&format!("gaze {strength}"), &weights, &fovea)
    }

    /// The right half counts so many times.
    fn importance(&self, times: f32) -> Errors {
        let right = self.region(|x, _| x > 0.5 * self.size.width as f32);
        let weights = Weights::default().with_importance(2, 1, vec![1.0, times]).expect("valid");
        self.compare(&format!("importance {times}"), &weights, &right)
    }
}

#[test]
fn less_error_where_it_counts() {
    for scene in ["sphere", "many"] {
        let stage = Stage::new(scene, Size::new(128, 96), 0.75);
        let [inside, _] = stage.gaze(1.0);
        assert!(inside < 0.99, "{scene}: {inside}");
        let [inside, outside] = stage.importance(16.0);
        assert!(inside < 0.97 && outside > 1.03, "{scene}: {inside} {outside}");
    }
}

/// `cargo test --release -p frameless-eval --test weights -- --ignored --nocapture`
#[test]
#[ignore = "minutes: the table in docs/evaluation.md"]
fn less_error_where_it_counts_at_full_size() {
    for scene in ["sphere", "many", "orbit", "mix"] {
        let stage = Stage::new(scene, Size::new(512, 384), 1.25);
        let gazes = [0.5, 1.0].map(|strength| stage.gaze(strength));
        let maps = [4.0, 16.0].map(|times| stage.importance(times));
        assert!(gazes.iter().chain(&maps).all(|[inside, _]| *inside < 1.0));
    }
}

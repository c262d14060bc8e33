//! Makes the pictures of docs/algorithm.md: what each stage of the algorithm sees and shows.
//!
//! ```sh
//! cargo run --release -p frameless-eval --example stages -- docs/images/algorithm
//! ```
//!
//! All at 900,000 samples/s, 512×384 and 60 Hz, cut out and twice as large unless said otherwise.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use frameless::{
    Adaptive, Answer, Canvas, Clock, Display, Engine, Findings, Insight, Kept, Observation, Rates,
    Reconstruction, ReconstructionKind, Refresh, Reproject, ReprojectOptions, ReprojectStage,
    Request, Sampler, SamplerKind, Size, Time,
};
use frameless_eval::{Experiment, Subject, SubjectTracer, refresh_time};

const SIZE: Size = Size { width: 512, height: 384 };
const DISPLAY_HZ: u32 = 60;
const RATE: f64 = 900_000.0;
const TILE: u32 = 8;

type Picture = Vec<[f32; 3]>;
type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let folder = std::env::args().nth(1).ok_or("usage: stages FOLDER")?;
    let album = Album { folder: PathBuf::from(folder) };
    std::fs::create_dir_all(&album.folder)?;
    carrying(&album)?;
    requests(&album)?;
    relighting(&album)?;
    antialiasing(&album)
}

/// From samples to a picture, and beside the other reconstructions: the camera goes round.
fn carrying(album: &Album) -> Result<(), Failure> {
    const SECS: f64 = 1.0;
    let cut = Cut { x: 240, y: 150, width: 128, height: 96, zoom: 2 };
    let subject = subject("mix", "")?;
    let carried = Arc::new(Mutex::new(Picture::new()));
    let stages = Stages {
        whole: Reproject::new(ReprojectOptions::default()),
        own: Reproject::new(ReprojectOptions {
            without: Some(ReprojectStage::Gather),
            ..ReprojectOptions::default()
        }),
        carried: carried.clone(),
    };
    let mut engine = start(&subject, SamplerKind::ADAPTIVE.build(1), Box::new(stages))?;
    let gathered = play(&mut engine, SECS)?;
    let known = engine.canvas().known();
    let carried = std::mem::take(&mut *carried.lock().expect("nobody panicked"));
    let black = carried.iter().zip(known).map(|(&rgb, known)| if known { rgb } else { [0.0; 3] });
    album.save("carried", &black.collect(), cut)?;
    album.save("gathered", &gathered, cut)?;
    let rates = engine.rates().ok_or("adaptive learns rates")?;
    let heat = (0..SIZE.pixels() as u32).map(|pixel| heat(rates.of_pixel(pixel))).collect();
    album.save_small("rates", &heat, 2)?;
    album.save_small("whole", &gathered, 3)?;
    for (name, kind) in [("hold", ReconstructionKind::Hold), ("filter", ReconstructionKind::Filter)]
    {
        let mut engine = start(&subject, SamplerKind::ADAPTIVE.build(1), kind.build())?;
        album.save(name, &play(&mut engine, SECS)?, cut)?;
    }
    album.save("ideal", &ideal(&subject, SECS), cut)
}

/// Who is asked for within one refresh, and why.
fn requests(album: &Album) -> Result<(), Failure> {
    const SECS: f64 = 1.0;
    let cut = Cut { x: 225, y: 170, width: 128, height: 96, zoom: 2 };
    let subject = subject("sphere", "")?;
    let asked = Arc::new(Mutex::new(Vec::new()));
    let sampler = Spy { sampler: Adaptive::new(0.5, 1), asked: asked.clone() };
    let kind = ReconstructionKind::REPROJECT;
    let mut engine = start(&subject, Box::new(sampler), kind.build())?;
    let mut picture = play(&mut engine, SECS)?;
    asked.lock().expect("nobody panicked").clear();
    play(&mut engine, SECS + 1.0 / f64::from(DISPLAY_HZ))?;
    picture.iter_mut().for_each(|rgb| *rgb = rgb.map(|c| 0.35 * c));
    for &(pixel, why) in asked.lock().expect("nobody panicked").iter() {
        picture[pixel as usize] = why.colour();
    }
    album.save("requests", &picture, cut)
}

/// The refresh at which the light jumps, and what is traced first then. A third as large.
fn relighting(album: &Album) -> Result<(), Failure> {
    // No sample knows of it yet.
    const SECS: f64 = 1.0;
    let cut = Cut { x: 190, y: 200, width: 128, height: 96, zoom: 2 };
    let subject = subject("sudden", "")?;
    for (name, kind) in [("unlit", "reproject"), ("relit", "reproject+relight")] {
        let kind = ReconstructionKind::from_name(kind).ok_or("a reconstruction")?;
        let mut engine = start(&subject, SamplerKind::ADAPTIVE.build(1), kind.build())?;
        let picture = play(&mut engine, SECS)?;
        album.save_small(name, &picture, 3)?;
        if name == "relit" {
            album.save("shadow-edges", &waiting(engine.canvas(), &picture), cut)?;
        }
    }
    album.save_small("lit", &ideal(&subject, SECS), 3)
}

/// At rest, 0.7 s after the sphere has stopped; four times as large.
fn antialiasing(album: &Album) -> Result<(), Failure> {
    const SECS: f64 = 1.5;
    let cut = Cut { x: 330, y: 180, width: 52, height: 39, zoom: 4 };
    let subject = subject("settle", "")?;
    for (name, kind) in [("jagged", "reproject"), ("smooth", "reproject+antialias")] {
        let kind = ReconstructionKind::from_name(kind).ok_or("a reconstruction")?;
        let mut engine = start(&subject, SamplerKind::ADAPTIVE.build(1), kind.build())?;
        album.save(name, &play(&mut engine, SECS)?, cut)?;
    }
    Ok(())
}

fn subject(scene: &str, events: &str) -> Result<Subject, Failure> {
    let text = format!(
        "title = \"stages\"\nsamples_per_sec = [{RATE}]\n[[scenes]]\nscene = \"{scene}\"\n{events}"
    );
    Ok(Subject::load(&Experiment::parse(&text, Path::new(""))?.scenes[0])?)
}

fn ideal(subject: &Subject, secs: f64) -> Picture {
    let display = Display::default();
    subject.ideal(secs, SIZE).into_iter().map(|rgb| display.encode(rgb)).collect()
}

/// With the whole picture of time 0, as in experiments.
fn start<'a>(
    subject: &'a Subject,
    sampler: Box<dyn Sampler>,
    reconstruction: Box<dyn Reconstruction>,
) -> Result<Engine<SubjectTracer<'a>>, Failure> {
    let requests: Vec<Request> = (0..SIZE.pixels() as u32).map(Request::centre).collect();
    let (rgb, surfaces) = subject.trace_surfaces(0.0, SIZE, &requests);
    let canvas = Canvas::from_picture(SIZE, rgb.clone());
    let clock = Clock::simulated(RATE);
    let mut engine = Engine::with_canvas(canvas, clock, sampler, subject.tracer(true));
    engine.set_reconstruction(reconstruction);
    let (batch, now) = (0, Time::ZERO);
    let known = Answer { batch, now, scene_secs: 0.0, size: SIZE, requests, rgb, surfaces };
    engine.start_with(&known)?;
    Ok(engine)
}

/// Runs until the refresh at `secs`, whose picture it returns.
fn play(engine: &mut Engine<SubjectTracer<'_>>, secs: f64) -> Result<Picture, Failure> {
    let mut picture = Picture::new();
    let begun = (engine.now().secs() * f64::from(DISPLAY_HZ) + 1e-3) as usize;
    for k in begun..(secs * f64::from(DISPLAY_HZ)).round() as usize {
        let time = refresh_time(k, DISPLAY_HZ);
        engine.run_until(time)?;
        picture = engine.refresh(time).to_vec();
    }
    Ok(picture)
}

/// The dimmed picture, and on it who waits to be traced, at once or just before the next refresh.
fn waiting(canvas: &Canvas, picture: &Picture) -> Picture {
    let mut marked: Picture = picture.iter().map(|rgb| rgb.map(|c| 0.35 * c)).collect();
    for &pixel in canvas.holes().iter().chain(canvas.last_minute()) {
        marked[pixel as usize] = Why::Hole.colour();
    }
    marked
}

/// v from 10⁻⁴ (black) over red and yellow to 1 per second (white), logarithmic.
fn heat(rate: f32) -> [f32; 3] {
    let t = ((rate.max(1e-9).log10() + 4.0) / 4.0).clamp(0.0, 1.0);
    [3.0 * t, 3.0 * t - 1.0, 3.0 * t - 2.0].map(|c| c.clamp(0.0, 1.0))
}

/// The whole algorithm, and what it carries along.
struct Stages {
    whole: Reproject,
    /// Is given the same samples, and shows every pixel's own.
    own: Reproject,
    carried: Arc<Mutex<Picture>>,
}

impl Reconstruction for Stages {
    fn keep(&mut self, kept: &Kept<'_>, display: &Display, findings: &mut Findings) {
        self.own.keep(kept, display, &mut Findings::default());
        self.whole.keep(kept, display, findings);
    }

    fn aim(&self, now: Time, canvas: &Canvas, requests: &mut [Request]) {
        self.whole.aim(now, canvas, requests);
    }

    fn refresh(&mut self, refresh: &Refresh<'_>, canvas: &mut Canvas) {
        self.own.refresh(refresh, canvas);
        self.carried.lock().expect("nobody panicked").clone_from(&self.own.picture().to_vec());
        self.whole.refresh(refresh, canvas);
    }

    fn picture(&self) -> &[[f32; 3]] {
        self.whole.picture()
    }
}

#[derive(Clone, Copy)]
enum Why {
    Hole,
    Front,
    Tile,
}

impl Why {
    fn colour(self) -> [f32; 3] {
        match self {
            Why::Hole => [1.0, 0.2, 0.2],
            Why::Front => [1.0, 0.8, 0.1],
            Why::Tile => [0.3, 0.7, 1.0],
        }
    }
}

/// Notes whom a sampler asks for.
struct Spy {
    sampler: Adaptive,
    asked: Arc<Mutex<Vec<(u32, Why)>>>,
}

impl Spy {
    /// Holes come first, in the canvas's order, and tiles last, in their own.
    fn reasons(canvas: &Canvas, requests: &[Request]) -> Vec<(u32, Why)> {
        let tile = |pixel: u32| {
            let (x, y) = SIZE.xy(pixel);
            y / TILE * SIZE.width.div_ceil(TILE) + x / TILE
        };
        let mut holes = canvas.holes().iter();
        let is_hole = |request: &&Request| holes.any(|&hole| hole == request.pixel);
        let holes = requests.iter().take_while(is_hole).count();
        let disorder = |pair: &[Request]| tile(pair[0].pixel) > tile(pair[1].pixel);
        let tiles = requests.windows(2).rposition(disorder).map_or(0, |last| last + 1).max(holes);
        let why = |i: usize| match i {
            i if i < holes => Why::Hole,
            i if i < tiles => Why::Front,
            _ => Why::Tile,
        };
        requests.iter().enumerate().map(|(i, request)| (request.pixel, why(i))).collect()
    }
}

impl Sampler for Spy {
    fn choose(&mut self, now: Time, canvas: &Canvas, count: usize, requests: &mut Vec<Request>) {
        self.sampler.choose(now, canvas, count, requests);
        self.asked.lock().expect("nobody panicked").extend(Spy::reasons(canvas, requests));
    }

    fn observe(&mut self, canvas: &Canvas, observations: &[Observation]) {
        self.sampler.observe(canvas, observations);
    }

    fn refines(&self) -> bool {
        self.sampler.refines()
    }

    fn rates(&self) -> Option<&Rates> {
        self.sampler.rates()
    }

    fn inspect(&self, now: Time, canvas: &Canvas) -> Insight {
        self.sampler.inspect(now, canvas)
    }
}

/// A part of the picture, and how many times as large it is shown.
#[derive(Clone, Copy)]
struct Cut {
    x: u32,
    y: u32,
    width: u32,
    height: u32,
    zoom: u32,
}

struct Album {
    folder: PathBuf,
}

impl Album {
    fn save(&self, name: &str, picture: &Picture, cut: Cut) -> Result<(), Failure> {
        let image =
            image::RgbImage::from_fn(cut.width * cut.zoom, cut.height * cut.zoom, |x, y| {
                let pixel = SIZE.index(cut.x + x / cut.zoom, cut.y + y / cut.zoom);
                image::Rgb(picture[pixel as usize].map(Display::quantize))
            });
        Ok(image.save(self.folder.join(format!("{name}.png")))?)
    }

    /// The whole picture; every pixel of the image is the mean of `side` × `side`.
    fn save_small(&self, name: &str, picture: &Picture, side: u32) -> Result<(), Failure> {
        let image = image::RgbImage::from_fn(SIZE.width / side, SIZE.height / side, |x, y| {
            let mut sum = [0.0; 3];
            for i in 0..side * side {
                let (x, y) = (x * side + i % side, y * side + i / side);
                let rgb = picture[SIZE.index(x, y) as usize];
                (0..3).for_each(|k| sum[k] += rgb[k] / (side * side) as f32);
            }
            image::Rgb(sum.map(Display::quantize))
        });
        Ok(image.save(self.folder.join(format!("{name}.png")))?)
    }
}

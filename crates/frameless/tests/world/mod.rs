//! A world whose picture is known in closed form: a textured plane (object 0) without any red, and before it a red disc (object 1), seen
//! by a camera that moves in the plane: so every pixel's ideal colour is a formula, and a mixture of the two objects shows at once.
// Each file of tests uses a part of this.
#![allow(dead_code)]

use frameless::{
    Answer, Batch, Canvas, Clock, Engine, Light, Lighting, Placement, Pose, Projection,
    ReconstructionKind, ReprojectOptions, Request, SamplerKind, Size, Surface, Time, Tracer,
};

pub(crate) const SIZE: Size = Size { width: 96, height: 72 };

/// Picture from plane at a time: column = a·x + b·y + c, row = d·x + e·y + f.
pub(crate) type Camera = fn(f64) -> [[f32; 3]; 2];

#[derive(Clone, Copy)]
pub(crate) struct World {
    pub(crate) camera: Camera,
    /// Middle and radius of the disc on the plane.
    pub(crate) disc: fn(f64) -> [f32; 3],
    /// Whether surfaces are told with a batch.
    pub(crate) surfaces: fn(u32) -> bool,
    /// What part of the light reaches a point (x, y) of the plane at a time.
    pub(crate) light: fn(f64, [f32; 2]) -> f32,
    /// How brightly the one lamp shines at a time.
    pub(crate) lamp: fn(f64) -> f32,
    /// Unit vector to it; +z is straight above.
    pub(crate) lamp_direction: fn(f64) -> [f32; 3],
    /// Colours are multiplied by 1 ± this, at random; 0: no noise.
    pub(crate) noise: f32,
}

pub(crate) const STILL: Camera = |_| [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
pub(crate) const NO_DISC: fn(f64) -> [f32; 3] = |_| [0.0, 0.0, -1.0];

pub(crate) fn translating(secs: f64) -> [[f32; 3]; 2] {
    let secs = secs as f32;
    [[1.0, 0.0, 40.0 * secs], [0.0, 1.0, -25.0 * secs]]
}

pub(crate) fn rotating(secs: f64) -> [[f32; 3]; 2] {
    let (sin, cos) = (secs as f32).sin_cos();
    let (x, y) = (48.0, 36.0);
    [[cos, -sin, x - cos * x + sin * y], [sin, cos, y - sin * x - cos * y]]
}

pub(crate) fn zooming(secs: f64) -> [[f32; 3]; 2] {
    let scale = 1.0 + 0.8 * secs as f32;
    [[scale, 0.0, 48.0 * (1.0 - scale)], [0.0, scale, 36.0 * (1.0 - scale)]]
}

impl World {
    pub(crate) fn plane_from_picture(&self, secs: f64, [column, row]: [f32; 2]) -> [f32; 2] {
        let [[a, b, c], [d, e, f]] = (self.camera)(secs);
        let (column, row, det) = (column - c, row - f, a * e - b * d);
        [(e * column - b * row) / det, (a * row - d * column) / det]
    }

    pub(crate) fn trace(&self, secs: f64, request: &Request) -> ([f32; 3], Surface) {
        let [x, y] = self.plane_from_picture(secs, request.position_px(SIZE));
        let [cx, cy, radius] = (self.disc)(secs);
        let (dx, dy) = (x - cx, y - cy);
        let is_disc = radius > 0.0 && dx * dx + dy * dy < radius * radius;
        let (object, position, rgb) = if is_disc {
            (1, [dx, dy, 0.0], [0.8, 0.0, 0.0])
        } else {
            let texture = 0.3 + 0.2 * (0.35 * x).sin() * (0.3 * y).cos();
            let lit = texture * (self.light)(secs, [x, y]);
            (0, [x, y, 0.0], [0.0, lit, 0.5 * lit])
        };
        let lit = u32::from((self.light)(secs, [x, y]) > 0.0);
        let (albedo, lamp) = (rgb, (self.lamp)(secs) * (self.lamp_direction)(secs)[2]);
        let noise = 1.0 + self.noise * random(request);
        let rgb = rgb.map(|c: f32| c * noise * lamp);
        let normal = [0.0, 0.0, 1.0];
        (rgb, Surface { object, primitive: 0, position, normal, albedo, direct: rgb, lit })
    }

    pub(crate) fn pose(&self, secs: f64) -> Pose {
        let [[a, b, c], [d, e, f]] = (self.camera)(secs);
        let [x, y, _] = (self.disc)(secs);
        let plane = |depth: f32, [x, y]: [f32; 2]| {
            Projection([
                [a, b, 0.0, a * x + b * y + c],
                [d, e, 0.0, d * x + e * y + f],
                [0.0, 0.0, 0.0, depth],
                [0.0, 0.0, 0.0, 1.0],
            ])
        };
        let picture_from_object = vec![plane(10.0, [0.0; 2]), plane(5.0, [x, y])];
        Pose { picture_from_object, ..Pose::default() }
    }

    /// One sample per pixel, without noise.
    pub(crate) fn ideal(&self, secs: f64) -> Vec<[f32; 3]> {
        let (display, quiet) = (frameless::Display::default(), World { noise: 0.0, ..*self });
        let pixels = 0..SIZE.pixels() as u32;
        pixels.map(|p| display.encode(quiet.trace(secs, &Request::centre(p)).0)).collect()
    }
}

pub(crate) struct Renderer {
    pub(crate) world: World,
    answers: Vec<Answer>,
}

impl Tracer for Renderer {
    fn submit(&mut self, batch: Batch) {
        let (rgb, surfaces): (Vec<_>, Vec<_>) =
            batch.requests.iter().map(|r| self.world.trace(batch.scene_secs, r)).unzip();
        let tells = (self.world.surfaces)(batch.id as u32);
        self.answers.push(Answer::to(batch, rgb, if tells { surfaces } else { Vec::new() }));
    }

    fn collect(&mut self, _wait: bool) -> Option<Answer> {
        self.answers.pop()
    }

    fn is_noisy(&self) -> bool {
        self.world.noise > 0.0
    }

    fn lighting(&mut self, scene_secs: f64, lighting: &mut Lighting) -> bool {
        let intensity = [(self.world.lamp)(scene_secs) * std::f32::consts::PI; 3];
        let backwards = (self.world.lamp_direction)(scene_secs);
        let range = f32::INFINITY;
        let lamp = Light { position: None, backwards, intensity, range, cone: None };
        let as_it_is = Placement {
            point: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
            normal: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        };
        *lighting = Lighting { lights: vec![lamp], world_from_object: vec![Some(as_it_is); 2] };
        true
    }

    fn pose(&mut self, scene_secs: f64, _size: Size, pose: &mut Pose) -> bool {
        *pose = self.world.pose(scene_secs);
        true
    }
}

pub(crate) fn world(camera: Camera, disc: fn(f64) -> [f32; 3]) -> World {
    World {
        camera,
        disc,
        surfaces: |_| true,
        light: |_, _| 1.0,
        lamp: |_| 1.0,
        lamp_direction: |_| [0.0, 0.0, 1.0],
        noise: 0.0,
    }
}

/// In [−1, 1), from the pixel and the sample's number.
pub(crate) fn random(request: &Request) -> f32 {
    let key = u64::from(request.pixel) << 32 | u64::from(request.sample_index);
    2.0 * frameless::Rng::new(key).unit_f32() - 1.0
}

pub(crate) fn engine(
    world: World,
    kind: ReconstructionKind,
    samples_per_sec: f64,
) -> Engine<Renderer> {
    let renderer = Renderer { world, answers: Vec::new() };
    let sampler = SamplerKind::ADAPTIVE.build(1);
    let clock = Clock::simulated(samples_per_sec);
    let mut engine = Engine::with_canvas(Canvas::new(SIZE), clock, sampler, renderer);
    engine.set_reconstruction(kind.build());
    engine
}

/// Runs for so many refreshes of 1/60 s; the last picture and its time.
pub(crate) fn play(engine: &mut Engine<Renderer>, refreshes: u64) -> (Vec<[f32; 3]>, f64) {
    let first = (engine.now().0 * 60).div_ceil(1_000_000_000);
    let mut picture = Vec::new();
    let mut time = Time::ZERO;
    for k in first..first + refreshes {
        time = Time((k + 1) * 1_000_000_000 / 60);
        engine.run_until(time).expect("finite colours");
        picture = engine.refresh(time).to_vec();
    }
    (picture, time.secs())
}

pub(crate) fn rmse(a: &[[f32; 3]], b: &[[f32; 3]]) -> f32 {
    let sum: f32 = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).powi(2)).sum();
    (sum / (3 * a.len()) as f32).sqrt()
}

/// How many pixels differ, and by how much at most.
pub(crate) fn differences(a: &[[f32; 3]], b: &[[f32; 3]]) -> (usize, f32) {
    let off =
        |(a, b): (&[f32; 3], &[f32; 3])| (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max);
    let offs = a.iter().zip(b).map(off);
    (offs.clone().filter(|off| *off > 0.0).count(), offs.fold(0.0, f32::max))
}

pub(crate) const KINDS: [ReconstructionKind; 4] =
    [ReconstructionKind::Hold, ReconstructionKind::Filter, ReconstructionKind::REPROJECT, DEEP];

pub(crate) const DEEP: ReconstructionKind = ReconstructionKind::Reproject(ReprojectOptions {
    deep: true,
    relight: false,
    antialias: false,
    without: None,
});

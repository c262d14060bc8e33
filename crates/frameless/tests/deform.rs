//! Samples on a mesh that deforms follow its vertices.

mod world;

use std::sync::Arc;

use frameless::{
    Answer, Batch, Canvas, Clock, Deformed, Display, Engine, Pose, Projection, ReconstructionKind,
    Request, SamplerKind, Size, Surface, Time, Tracer,
};
use world::{SIZE, STILL, differences, rmse};

/// Two triangles (object 0), whose four corners move each in its own way until 0.5 s, before a grey plane (object 1).
const TRIANGLES: [[u32; 3]; 2] = [[0, 1, 2], [2, 1, 3]];

fn corners(secs: f64) -> [[f32; 2]; 4] {
    let t = secs.min(0.5) as f32;
    let (sin, cos) = (6.0 * t).sin_cos();
    [
        [10.0 + 12.0 * sin, 8.0],
        [70.0 + 30.0 * t, 6.0 + 10.0 * sin],
        [14.0, 60.0 - 20.0 * t],
        [80.0 - 12.0 * cos, 64.0],
    ]
}

/// Barycentric weights of a point in a triangle; `None` outside.
fn weights(corners: [[f32; 2]; 3], [x, y]: [f32; 2]) -> Option<[f32; 3]> {
    let [[ax, ay], [bx, by], [cx, cy]] = corners;
    let det = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay);
    let u = ((x - ax) * (cy - ay) - (cx - ax) * (y - ay)) / det;
    let v = ((bx - ax) * (y - ay) - (x - ax) * (by - ay)) / det;
    let weights = [1.0 - u - v, u, v];
    weights.iter().all(|&weight| weight >= 0.0).then_some(weights)
}

/// The pattern lies on the undeformed mesh: it moves with the material.
fn colour(triangle: usize, weights: [f32; 3]) -> [f32; 3] {
    const AT_REST: [[f32; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let (mut u, mut v) = (0.0, 0.0);
    for (&corner, weight) in TRIANGLES[triangle].iter().zip(weights) {
        u += weight * AT_REST[corner as usize][0];
        v += weight * AT_REST[corner as usize][1];
    }
    let pattern = 0.4 + 0.3 * (40.0 * u).sin() * (30.0 * v).cos();
    [pattern, 0.3 * pattern, 0.1]
}

fn trace(secs: f64, request: &Request) -> ([f32; 3], Surface) {
    let px = request.position_px(SIZE);
    let corners = corners(secs);
    let hit = TRIANGLES.iter().enumerate().find_map(|(triangle, indices)| {
        Some((triangle, weights(indices.map(|i| corners[i as usize]), px)?))
    });
    let (object, primitive, position, rgb) = match hit {
        Some((triangle, weights)) => (0, triangle as u32, weights, colour(triangle, weights)),
        None => (1, 0, [px[0], px[1], 0.0], [0.2; 3]),
    };
    let surface = Surface {
        object,
        primitive,
        position,
        normal: [0.0, 0.0, 1.0],
        albedo: rgb,
        direct: [0.0; 3],
        lit: 1,
    };
    (rgb, surface)
}

struct Mesh {
    answer: Option<Answer>,
}

impl Tracer for Mesh {
    fn submit(&mut self, batch: Batch) {
        let (rgb, surfaces) = batch.requests.iter().map(|r| trace(batch.scene_secs, r)).unzip();
        self.answer = Some(Answer::to(batch, rgb, surfaces));
    }

    fn collect(&mut self, _wait: bool) -> Option<Answer> {
        self.answer.take()
    }

    fn pose(&mut self, secs: f64, _size: Size, pose: &mut Pose) -> bool {
        let plane = |depth: f32| {
            let [[a, b, c], [d, e, f]] = STILL(secs);
            let rows = [[a, b, 0.0, c], [d, e, 0.0, f]];
            Projection([rows[0], rows[1], [0.0, 0.0, 0.0, depth], [0.0, 0.0, 0.0, 1.0]])
        };
        let deformed = Deformed {
            triangles: Arc::new(TRIANGLES.to_vec()),
            positions: Arc::new(corners(secs).map(|[x, y]| [x, y, 0.0]).to_vec()),
        };
        pose.picture_from_object = vec![plane(5.0), plane(10.0)];
        pose.deformed = vec![Some(deformed)];
        true
    }
}

fn ideal(secs: f64) -> Vec<[f32; 3]> {
    let display = Display::default();
    let pixels = 0..SIZE.pixels() as u32;
    pixels.map(|pixel| display.encode(trace(secs, &Request::centre(pixel)).0)).collect()
}

/// After so many refreshes of 1/60 s, with a tenth of the pixels in each.
fn play(kind: ReconstructionKind, refreshes: u64) -> (Vec<[f32; 3]>, f64) {
    let sampler = SamplerKind::ADAPTIVE.build(1);
    let clock = Clock::simulated(40_000.0);
    let mut engine = Engine::with_canvas(Canvas::new(SIZE), clock, sampler, Mesh { answer: None });
    engine.set_reconstruction(kind.build());
    let mut picture = Vec::new();
    let mut time = Time::ZERO;
    for k in 1..=refreshes {
        time = Time(k * 1_000_000_000 / 60);
        engine.run_until(time).expect("finite colours");
        picture = engine.refresh(time).to_vec();
    }
    (picture, time.secs())
}

#[test]
fn samples_follow_the_vertices_of_a_deforming_mesh() {
    let error = |kind| {
        let (picture, secs) = play(kind, 24);
        rmse(&picture, &ideal(secs))
    };
    let (hold, reproject) = (error(ReconstructionKind::Hold), error(ReconstructionKind::REPROJECT));
    assert!(reproject < 0.5 * hold, "{reproject}, hold {hold}");
}

#[test]
fn a_mesh_that_has_come_to_rest_is_the_held_picture_bit_for_bit() {
    let (picture, secs) = play(ReconstructionKind::REPROJECT, 30 + 60);
    assert_eq!(differences(&picture, &ideal(secs)), (0, 0.0));
}

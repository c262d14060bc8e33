//! An object jumps while the scene plays: how long until the pixels that it changes are right again, with paths, on the real clock.
//!
//! Which object, unless one is named: of those that cover from 1 % to 10 % of the picture, the one that covers most. Smaller ones say little, and
//! larger ones are not what one moves.

use std::sync::Arc;

use anyhow::anyhow;
use frameless::{Clock, Display, Engine, ReconstructionKind, Request, SamplerKind, Size};
use frameless_scene::{AfterEnd, Channel, Interpolation, Limits, Scene, Target, Values};
use frameless_trace::{
    CpuTracer, Integrator, Settings, Still, ViewSource, World, render_still, thread_pool,
};
use glam::Vec3;

use super::table::Row;
use crate::args::BenchArgs;
use crate::failure::Failure;
use crate::input;

const CAMERA: ViewSource = ViewSource::Camera(0);
const PATH: Settings =
    Settings { integrator: Integrator::Path, max_depth: 4, lens: None, surfaces: true };
/// In the world.
const JUMP_M: Vec3 = Vec3::new(0.1, 0.0, 0.0);
/// When it comes; by then the picture has settled.
const JUMP_SECS: f64 = 6.0;
/// For how long it is looked at afterwards.
const WATCHED_SECS: f64 = 4.0;
const REFRESHES_PER_SEC: f64 = 30.0;
/// Of the converged pictures before and after, which are made by the same random numbers: what differs is the object.
const IDEAL_SAMPLES: u32 = 256;
/// In display-referred sRGB: what one sees.
const CHANGED: f32 = 0.04;
const RIGHT: f32 = 0.05;

/// Rows `edit.secs_until_right`, `edit.rmse_at_once` and `_after_1_s` (of the changed pixels), `edit.changed_percent` and
/// `edit.samples_per_sec`.
pub(super) fn measure(args: &BenchArgs) -> Result<Vec<Row>, Failure> {
    let mut scene = input::scene(args.scene(), &args.choice(), &Limits::default())?;
    let node = match args.object() {
        Some(name) => named(&scene, name),
        None => most_seen(&scene, args.size),
    };
    let node = node.ok_or_else(|| match args.object() {
        Some(_) => Failure::bad_input(anyhow!("--object: nothing to be seen has that name")),
        None => Failure::bad_input(anyhow!(
            "nothing covers from 1 % to 10 % of the picture: name what is to move with --object"
        )),
    })?;
    let name = let_jump(&mut scene, node);
    let world = Arc::new(World::new(Arc::new(scene)));
    let [before, after] = [0.0, JUMP_SECS + 1.0].map(|secs| ideal(&world, secs, args));
    let changed: Vec<usize> =
        (0..after.len()).filter(|&pixel| apart(before[pixel], after[pixel]) > CHANGED).collect();
    if changed.is_empty() {
        return Err(Failure::bad_input(anyhow!("{name} changes nothing that the camera sees")));
    }
    let looks: Vec<Look> = (0..args.rounds)
        .map(|seed| look(&world, args, u64::from(seed), &changed, &after))
        .collect();
    let conditions = format!(
        "{}, {name} moved by 10 cm, {}×{}, path, adaptive+reproject, real clock, {} rounds; right: RMSE of the changed pixels at most \
         {RIGHT}; {WATCHED_SECS} s: not within that time",
        args.scene(),
        args.size.width,
        args.size.height,
        args.rounds
    );
    let row = |name: &str, unit, of: fn(&Look) -> f64| {
        let rounds: Vec<f64> = looks.iter().map(of).collect();
        Row::new(name, unit, &rounds, &conditions)
    };
    let percent = 100.0 * changed.len() as f64 / after.len() as f64;
    Ok(vec![
        row("edit.secs_until_right", "s", |look| look.secs_until_right),
        row("edit.rmse_at_once", "RMSE", |look| look.rmse_at_once),
        row("edit.rmse_after_1_s", "RMSE", |look| look.rmse_after_1_s),
        Row::new("edit.changed_percent", "% of the pixels", &[percent], &conditions),
        row("edit.samples_per_sec", "samples/s", |look| look.samples_per_sec),
    ])
}

/// The node of that name, if something stands there.
fn named(scene: &Scene, name: &str) -> Option<u32> {
    let mut nodes = scene.instances.iter().map(|instance| instance.node);
    nodes.find(|&node| scene.nodes[node as usize].name == name)
}

/// The node of the object that covers most pixels among those with 1 % to 10 % of them.
fn most_seen(scene: &Scene, size: Size) -> Option<u32> {
    let world = World::new(Arc::new(scene.clone()));
    let moment = world.moment(0.0);
    let view = scene.view_at(moment.state(), 0);
    let mut pixels = vec![0; scene.instances.len()];
    for pixel in 0..size.pixels() as u32 {
        let (_, seen) = world.trace(&moment, &view, size, &Request::centre(pixel), &PATH);
        // Not the sky, nor images in mirrors.
        if let Some(pixels) = pixels.get_mut(seen.object as usize) {
            *pixels += 1;
        }
    }
    let some = size.pixels() / 100..=size.pixels() / 10;
    let seen = scene.instances.iter().zip(pixels).filter(|(_, pixels)| some.contains(pixels));
    // Of those that are seen equally much the first.
    let most = seen.rev().max_by_key(|(_, pixels)| *pixels);
    most.map(|(instance, _)| instance.node)
}

/// Lets what is at a node jump, which stands still otherwise; returns its name.
fn let_jump(scene: &mut Scene, node: u32) -> String {
    let (placed, state) = (&scene.nodes[node as usize], scene.state_at(0.0));
    let jump = match placed.parent {
        None => JUMP_M,
        Some(parent) => {
            let parent = state.world_from_node[parent as usize].matrix3.inverse();
            (parent * glam::Vec3A::from(JUMP_M)).into()
        }
    };
    let place = placed.rest.translation;
    let name = match placed.name.as_str() {
        "" => format!("node {node}"),
        name => name.to_owned(),
    };
    let animation = &mut scene.animation;
    animation.channels.retain(|channel| channel.target != Target::Translation(node));
    animation.channels.push(Channel {
        target: Target::Translation(node),
        times: vec![0.0, JUMP_SECS as f32],
        values: Values::Vec3(vec![place, place + jump]),
        interpolation: Interpolation::Step,
    });
    animation.duration_secs = animation.duration_secs.max(JUMP_SECS + WATCHED_SECS + 1.0);
    animation.after_end = AfterEnd::Hold;
    name
}

/// Display-referred.
fn ideal(world: &World, secs: f64, args: &BenchArgs) -> Vec<[f32; 3]> {
    let (size, samples) = (args.size, IDEAL_SAMPLES);
    let still = Still { secs, view: CAMERA, size, settings: PATH, samples, first_sample: 0 };
    let linear = render_still(world, &still, &thread_pool(args.threads), || ());
    linear.into_iter().map(|rgb| Display::default().encode(rgb)).collect()
}

struct Look {
    secs_until_right: f64,
    rmse_at_once: f64,
    rmse_after_1_s: f64,
    samples_per_sec: f64,
}

/// Plays the scene beyond the jump, with pictures all the time.
fn look(
    world: &Arc<World>,
    args: &BenchArgs,
    seed: u64,
    changed: &[usize],
    ideal: &[[f32; 3]],
) -> Look {
    let tracer = CpuTracer::new(Arc::clone(world), CAMERA, PATH, args.threads);
    let sampler = SamplerKind::ADAPTIVE.build(seed);
    let mut engine = Engine::new(args.size, Clock::real(), sampler, tracer);
    engine.set_reconstruction(ReconstructionKind::default().build());
    let mut errors: Vec<(f64, f64)> = Vec::new();
    let (mut refreshed, mut kept) = (0.0, 0);
    loop {
        engine.step().expect("the tracer's colours are finite");
        let now = engine.now();
        let since = now.secs() - JUMP_SECS;
        if now.secs() - refreshed < 1.0 / REFRESHES_PER_SEC {
            continue;
        }
        refreshed = now.secs();
        let picture = engine.refresh(now);
        if since < 0.0 {
            kept = engine.counters().kept;
            continue;
        }
        errors.push((since, rmse(picture, ideal, changed)));
        if since > WATCHED_SECS {
            let samples = engine.counters().kept - kept;
            return Look::of(&errors, samples as f64 / since);
        }
    }
}

impl Look {
    /// `errors`: seconds since the jump, and the RMSE then.
    fn of(errors: &[(f64, f64)], samples_per_sec: f64) -> Look {
        let right = |&(_, rmse): &(f64, f64)| rmse <= f64::from(RIGHT);
        let wrong = errors.iter().rposition(|error| !right(error));
        let to_stay = wrong.map_or(0, |last| last + 1);
        let at = |secs: f64| errors.iter().find(|error| error.0 >= secs).map_or(0.0, |e| e.1);
        Look {
            secs_until_right: errors.get(to_stay).map_or(WATCHED_SECS, |error| error.0),
            rmse_at_once: at(0.0),
            rmse_after_1_s: at(1.0),
            samples_per_sec,
        }
    }
}

fn apart(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max)
}

fn rmse(picture: &[[f32; 3]], ideal: &[[f32; 3]], pixels: &[usize]) -> f64 {
    let square = |pixel: &usize| {
        (0..3).map(|k| f64::from(picture[*pixel][k] - ideal[*pixel][k]).powi(2)).sum::<f64>()
    };
    (pixels.iter().map(square).sum::<f64>() / (3 * pixels.len()) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn right_is_what_stays_right() {
        let errors = [(0.0, 0.2), (0.5, 0.04), (1.0, 0.06), (1.5, 0.03), (2.0, 0.01)];
        let look = Look::of(&errors, 1.0);
        assert_eq!(
            (look.secs_until_right, look.rmse_at_once, look.rmse_after_1_s),
            (1.5, 0.2, 0.06)
        );
        assert_eq!(Look::of(&errors[..3], 1.0).secs_until_right, WATCHED_SECS);
    }

    #[test]
    fn an_object_jumps_once_by_ten_centimetres_of_the_world() {
        let mut scene = frameless_scene::builtin("sphere").expect("it is built in");
        let node = scene.instances[0].node;
        let name = let_jump(&mut scene, node);
        assert_eq!(named(&scene, &name), Some(node));
        assert_eq!(named(&scene, "nobody"), None);
        let node = node as usize;
        let at = |secs: f64| scene.state_at(secs).world_from_node[node].translation;
        assert_eq!(at(0.0), at(JUMP_SECS - 0.01));
        let jump = at(JUMP_SECS) - at(0.0);
        assert!(jump.abs_diff_eq(JUMP_M.into(), 1e-5), "{jump}");
    }

    #[test]
    fn what_moves_is_seen_much_but_not_too_much() {
        let scene = frameless_scene::builtin("sphere").expect("it is built in");
        let size = Size::new(64, 48);
        let node = most_seen(&scene, size).expect("something is of that size");
        let world = World::new(Arc::new(scene.clone()));
        let moment = world.moment(0.0);
        let view = scene.view_at(moment.state(), 0);
        let seen = |pixel| world.trace(&moment, &view, size, &Request::centre(pixel), &PATH).1;
        let objects: Vec<u32> = (0..size.pixels() as u32).map(|pixel| seen(pixel).object).collect();
        let covers = |at: u32| {
            let is_there = |object: &&u32| {
                scene.instances.get(**object as usize).is_some_and(|seen| seen.node == at)
            };
            objects.iter().filter(is_there).count()
        };
        let (covered, all) = (covers(node), size.pixels());
        assert!((all / 100..=all / 10).contains(&covered), "{covered} of {all}");
        for other in &scene.instances {
            assert!(covers(other.node) <= covered || covers(other.node) > all / 10);
        }
    }
}

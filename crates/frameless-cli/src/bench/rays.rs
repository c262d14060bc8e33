//! Bare rays: how many per second and thread, beside Embree where it is found, in alternating rounds of one run.

mod embree;
mod generated;
mod sets;

use std::path::Path;
use std::sync::Arc;

use frameless::Size;
use frameless_scene::{Geometry, Limits, Scene, State};
use frameless_trace::{Caster, SHADED, WAVE, World};

use self::embree::{Embree, EmbreeScene, HOW_TO_GET, Triangles};
use self::sets::{Asks, Set, Together, trace_ours, trace_together};
use super::table::Row;
use crate::args::BenchArgs;
use crate::failure::Failure;
use crate::input;

/// Beside the generated scene, where they are there.
const FILES: [(&str, &str); 2] =
    [("bathroom", "Bathroom/LAZIENKA.gltf"), ("apartment", "DreamApartment.glb")];
const FOLDER: &str = "../shared/scenes/architecture";
const INSTANCES: [u32; 3] = [1, 100, 10_000];
/// t may differ by this part of itself: two ways to compute the same intersection of a ray that grazes.
const TOLERANCE: f32 = 1e-3;

/// Rows `rays.<scene>.<set>.…`: `mrays_per_sec`, of ours as the renderer traces them, [`WAVE`] or [`SHADED`] at once, and `single_mrays_per_sec`, one by one;
/// with Embree `embree_mrays_per_sec`, one by one, `ratio_to_embree` and `single_ratio_to_embree`, round by round, and `mismatches`, rays with
/// another answer; and `packet_over_single`, ours at once against ours one by one.
pub(super) fn measure(args: &BenchArgs) -> Result<Vec<Row>, Failure> {
    let named = args.embree.as_deref();
    let embree = Embree::find(named).map_err(|e| Failure::bad_input(anyhow::anyhow!(e)))?;
    if embree.is_none() {
        log::warn!("{HOW_TO_GET}");
    }
    let bench = Bench { embree: embree.as_ref(), args };
    let mut rows = Vec::new();
    for (name, scene) in scenes(args)? {
        rows.extend(bench.scene(&name, scene));
    }
    if args.named_scene().is_none() {
        for count in INSTANCES {
            rows.extend(bench.instances(count));
        }
    }
    Ok(rows)
}

/// The generated scene and the files that are there; or the one that was asked for.
fn scenes(args: &BenchArgs) -> Result<Vec<(String, Scene)>, Failure> {
    let load = |name: &str| input::scene(name, &args.choice(), &Limits::default());
    if let Some(name) = args.named_scene() {
        if name == "generated" {
            return Ok(vec![(name.into(), generated::hall(args.detail()))]);
        }
        let stem = Path::new(name).file_stem().map(|stem| stem.to_string_lossy().to_lowercase());
        return Ok(vec![(stem.unwrap_or_default(), load(name)?)]);
    }
    let mut scenes = vec![("generated".into(), generated::hall(args.detail()))];
    for (name, file) in FILES {
        let path = Path::new(FOLDER).join(file);
        if path.exists() {
            scenes.push((name.into(), load(&path.to_string_lossy())?));
        } else {
            log::warn!("{}: not there, so it is left out", path.display());
        }
    }
    Ok(scenes)
}

struct Bench<'a> {
    embree: Option<&'a Embree>,
    args: &'a BenchArgs,
}

impl Bench<'_> {
    fn size(&self) -> Size {
        self.args.size
    }

    fn scene(&self, name: &str, scene: Scene) -> Vec<Row> {
        let world = World::new(Arc::new(scene));
        let theirs = self
            .embree
            .map(|embree| embree.scene(&in_world(world.scene(), &world.scene().state_at(0.0))));
        let mut rows = Vec::new();
        for set in sets::of_scene(&world, self.size()) {
            rows.extend(self.set(name, &world, theirs.as_ref(), &set));
        }
        rows
    }

    fn instances(&self, count: u32) -> Vec<Row> {
        let world = World::new(Arc::new(generated::swarm(count, self.args.detail())));
        let theirs = self.embree.map(|embree| {
            let scene = world.scene();
            let state = scene.state_at(0.0);
            let places: Vec<_> = (0..scene.instances.len())
                .map(|instance| scene.world_from_instance(instance, &state))
                .collect();
            embree.instances(embree.scene(&own_coordinates(scene)), &places)
        });
        let set = sets::of_instances(&world, count, self.size());
        self.set("generated", &world, theirs.as_ref(), &set)
    }

    fn set(
        &self,
        scene: &str,
        world: &World,
        theirs: Option<&EmbreeScene<'_>>,
        set: &Set,
    ) -> Vec<Row> {
        let moment = world.moment(0.0);
        let mut caster = world.caster(&moment);
        let mut found = [vec![0.0; set.rays.len()], vec![0.0; set.rays.len()]];
        let [alone_found, theirs_found] = &mut found;
        let mut ours_found = Together::of(set);
        let mut speeds = Speeds::default();
        for round in 0..self.args.rounds {
            let ours = |caster: &mut Caster<'_>, found: &mut Together| {
                mrays_per_sec(set, || trace_together(caster, set, found))
            };
            let other = |found: &mut [f32]| {
                theirs.map(|theirs| mrays_per_sec(set, || trace_theirs(theirs, set, found)))
            };
            let alone = |caster: &mut Caster<'_>, found: &mut [f32]| {
                mrays_per_sec(set, || trace_ours(caster, set, found))
            };
            // Everybody is first as often as last.
            let (ours, other, alone) = if round % 2 == 0 {
                let ours = ours(&mut caster, &mut ours_found);
                let other = other(theirs_found);
                (ours, other, alone(&mut caster, alone_found))
            } else {
                let alone = alone(&mut caster, alone_found);
                let other = other(theirs_found);
                (ours(&mut caster, &mut ours_found), other, alone)
            };
            speeds.ours.push(ours);
            speeds.theirs.extend(other);
            speeds.alone.push(alone);
        }
        let ours_found = ours_found.found(set);
        assert!(ours_found == *alone_found, "rays found something else together");
        let wants_coherent = set.name == "primary-scan" || set.name == "primary-sorted";
        if let Some(theirs) = theirs.filter(|_| wants_coherent) {
            for _ in 0..self.args.rounds {
                let speed = mrays_per_sec(set, || trace_eights(theirs, set, theirs_found));
                speeds.theirs_in_eights.push(speed);
            }
            trace_theirs(theirs, set, theirs_found);
        }
        let mismatches = theirs.map(|_| mismatches(&ours_found, theirs_found));
        self.rows(&format!("rays.{scene}.{}", set.name), set, &speeds, mismatches)
    }

    fn rows(&self, name: &str, set: &Set, speeds: &Speeds, mismatches: Option<f64>) -> Vec<Row> {
        let rival = self.embree.map_or(String::new(), |embree| {
            format!(
                "; Embree {} with its default flags and build quality, one ray at a time",
                embree.version
            )
        });
        let conditions = format!(
            "{} rays, {}×{}, one thread, thread CPU time, {} alternating rounds; ours {WAVE} at once as in the renderer, rays to lights \
             {SHADED}; single: one at a time{rival}",
            set.rays.len(),
            self.size().width,
            self.size().height,
            self.args.rounds
        );
        let row = |what: &str, unit, rounds: &[f64]| {
            Row::new(format!("{name}.{what}"), unit, rounds, &conditions)
        };
        let ratios = |ours: &[f64], others: &[f64]| -> Vec<f64> {
            ours.iter().zip(others).map(|(ours, other)| ours / other).collect()
        };
        let mut rows = vec![
            row("mrays_per_sec", "Mrays/s", &speeds.ours),
            row("single_mrays_per_sec", "Mrays/s", &speeds.alone),
        ];
        if set.name == "primary-sorted" {
            let gains = ratios(&speeds.ours, &speeds.alone);
            rows.push(row("packet_over_single", "ratio", &gains));
        }
        let Some(mismatches) = mismatches else { return rows };
        rows.push(row("embree_mrays_per_sec", "Mrays/s", &speeds.theirs));
        if !speeds.theirs_in_eights.is_empty() {
            let what = "embree_coherent8_mrays_per_sec";
            rows.push(row(what, "Mrays/s", &speeds.theirs_in_eights));
        }
        let (to_theirs, alone) =
            (ratios(&speeds.ours, &speeds.theirs), ratios(&speeds.alone, &speeds.theirs));
        rows.push(row("ratio_to_embree", "ratio", &to_theirs));
        rows.push(row("single_ratio_to_embree", "ratio", &alone));
        rows.push(row("mismatches", "rays", &[mismatches]));
        rows
    }
}

/// Round by round.
#[derive(Default)]
struct Speeds {
    ours: Vec<f64>,
    alone: Vec<f64>,
    theirs: Vec<f64>,
    theirs_in_eights: Vec<f64>,
}

fn trace_theirs(scene: &EmbreeScene<'_>, set: &Set, found: &mut [f32]) {
    match set.asks {
        Asks::Nearest => {
            for (ray, found) in set.rays.iter().zip(found) {
                *found = scene.nearest(ray);
            }
        }
        Asks::Blocked => {
            for (ray, found) in set.rays.iter().zip(found) {
                *found = if scene.is_blocked(ray, 1.0) { 0.0 } else { 1.0 };
            }
        }
    }
}

fn trace_eights(scene: &EmbreeScene<'_>, set: &Set, found: &mut [f32]) {
    for (rays, found) in set.rays.as_chunks().0.iter().zip(found.as_chunks_mut::<8>().0) {
        *found = scene.nearest_of_eight(rays);
    }
}

/// How many rays have another answer.
fn mismatches(ours: &[f32], theirs: &[f32]) -> f64 {
    let agree = |(a, b): (&f32, &f32)| a == b || (a - b).abs() <= TOLERANCE * a.min(*b);
    ours.iter().zip(theirs).filter(|&pair| !agree(pair)).count() as f64
}

/// Every instance's triangles where they are in the world: what is fastest for Embree.
fn in_world(scene: &Scene, state: &State) -> Vec<Triangles> {
    let meshes = scene.instances.iter().enumerate().filter_map(|(index, instance)| {
        let Geometry::Mesh(mesh) = &scene.geometries[instance.geometry as usize] else {
            return None;
        };
        let place = scene.world_from_instance(index, state);
        let positions = mesh.positions.iter().map(|&p| place.transform_point3(p)).collect();
        Some(Triangles { positions, triangles: mesh.triangles.clone() })
    });
    meshes.collect()
}

fn own_coordinates(scene: &Scene) -> Vec<Triangles> {
    let meshes = scene.geometries.iter().filter_map(|geometry| match geometry {
        Geometry::Mesh(mesh) => {
            let (positions, triangles) = (mesh.positions.clone(), mesh.triangles.clone());
            Some(Triangles { positions, triangles })
        }
        Geometry::Sphere { .. } => None,
    });
    meshes.collect()
}

/// Of the second of two times: a large tree is in the cache then as far as it fits, as in a renderer, whoever was measured before. (In turns of
/// two, each would find its own tree there in every other round, and a median over an odd number of rounds would choose between them.)
fn mrays_per_sec(set: &Set, mut trace: impl FnMut()) -> f64 {
    trace();
    let begin = cpu_secs();
    trace();
    set.rays.len() as f64 * 1e-6 / (cpu_secs() - begin)
}

/// Seconds for which this thread has run, whatever else the machine does.
#[cfg(target_os = "linux")]
fn cpu_secs() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

/// Elsewhere: of the wall clock.
#[cfg(not(target_os = "linux"))]
fn cpu_secs() -> f64 {
    use std::sync::OnceLock;
    static CLOCK: OnceLock<frameless::Clock> = OnceLock::new();
    let clock = CLOCK.get_or_init(frameless::Clock::real);
    clock.now().secs_since(frameless::Time::ZERO)
}

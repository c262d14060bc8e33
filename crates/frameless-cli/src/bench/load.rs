//! Opening a scene: how long until its first pixel, and how much memory that takes.

use std::process::Command;
use std::sync::Arc;

use anyhow::Context;
use frameless::Clock;
use frameless_scene::{Geometry, Limits, Scene};
use frameless_session::{Session, Settings};
use frameless_trace::{CpuTracer, ViewSource, World};
use serde::Deserialize;

use super::table::Row;
use crate::args::BenchArgs;
use crate::failure::Failure;
use crate::input;

/// Rows `load.to_first_pixel_secs`, from opening the file until the loop has kept a sample of it, and of that `load.read_secs` and
/// `load.prepare_secs` (trees, smaller copies of textures); `load.peak_memory_over_content`, the most memory that the process has held until
/// the scene was prepared, all of the program with it, by what the scene's vertices, indices and decoded pictures take;
/// `load.added_memory_over_content`, the same less what the process held before; `load.content_mib`. What a canvas takes depends on its
/// size and not on the scene.
///
/// Every round is a process of its own: memory that was used before is not used again, and nothing is warm but the file.
pub(super) fn measure(args: &BenchArgs) -> Result<Vec<Row>, Failure> {
    let rounds = match args.rounds {
        1 => vec![once(args)?],
        rounds => (0..rounds)
            .map(|_| elsewhere().map_err(Failure::bad_input))
            .collect::<Result<Vec<_>, Failure>>()?,
    };
    let conditions = format!(
        "{}, {}×{}, {} threads, {} rounds, each in a process of its own; the file is in the system's cache",
        args.scene(),
        args.size.width,
        args.size.height,
        super::threads(args),
        args.rounds
    );
    let figures = FIGURES.iter().zip(0..rounds[0].len());
    let rows = figures.map(|((name, unit), i)| {
        let values: Vec<f64> = rounds.iter().map(|round| round[i]).collect();
        Row::new(*name, unit, &values, &conditions)
    });
    Ok(rows.collect())
}

/// Names and units, in the order in which a round gives them. Memory comes last: not every system tells.
const FIGURES: [(&str, &str); 6] = [
    ("load.to_first_pixel_secs", "s"),
    ("load.read_secs", "s"),
    ("load.prepare_secs", "s"),
    ("load.content_mib", "MiB"),
    ("load.peak_memory_over_content", "times"),
    ("load.added_memory_over_content", "times"),
];

fn once(args: &BenchArgs) -> Result<Vec<f64>, Failure> {
    let before = Memory::now();
    let clock = Clock::real();
    let limits = Limits::default();
    let scene = Arc::new(input::scene(args.scene(), &args.choice(), &limits)?);
    let read = clock.now().secs();
    let world = World::open(args.scene(), Arc::clone(&scene), &limits);
    let world = Arc::new(world.map_err(Failure::bad_input)?);
    let prepared = clock.now().secs();
    let after = Memory::now();
    let (view, tracing) = (ViewSource::Camera(0), frameless_trace::Settings::default());
    let tracer = CpuTracer::new(world, view, tracing, args.threads);
    let mut session = Session::new(args.size, Clock::real(), Settings::default(), 1, tracer);
    while session.step().map_err(anyhow::Error::from)? == 0 {}
    let first_pixel = clock.now().secs();
    // A scene of spheres has next to none.
    let content = content_bytes(&scene).max(1) as f64;
    let mut figures = vec![first_pixel, read, prepared - read, content / f64::from(1 << 20)];
    if let (Some(before), Some(after)) = (before, after) {
        let added_bytes = after.peak_bytes - before.present_bytes;
        figures.extend([after.peak_bytes / content, added_bytes / content]);
    }
    Ok(figures)
}

/// The same by a process of its own.
fn elsewhere() -> anyhow::Result<Vec<f64>> {
    #[derive(Deserialize)]
    struct Report {
        rows: Vec<Told>,
    }
    #[derive(Deserialize)]
    struct Told {
        value: f64,
    }
    let program = std::env::current_exe().context("the program's own file")?;
    let arguments = std::env::args_os().skip(1);
    let run = Command::new(program).args(arguments).args(["--rounds", "1", "--json"]).output()?;
    let complaint = String::from_utf8_lossy(&run.stderr);
    anyhow::ensure!(run.status.success(), "{}", complaint.trim_start_matches("error: ").trim());
    let report: Report = serde_json::from_slice(&run.stdout)?;
    Ok(report.rows.into_iter().map(|row| row.value).collect())
}

/// What the process holds of the machine's memory.
struct Memory {
    present_bytes: f64,
    peak_bytes: f64,
}

impl Memory {
    /// As the system tells it (`VmRSS` and `VmHWM` in /proc/self/status).
    fn now() -> Option<Memory> {
        let status = std::fs::read_to_string("/proc/self/status").ok()?;
        let kib = |key: &str| -> Option<f64> {
            let line = status.lines().find(|line| line.starts_with(key))?;
            line.split_whitespace().nth(1)?.parse().ok()
        };
        let [present_bytes, peak_bytes] = [kib("VmRSS:")? * 1024.0, kib("VmHWM:")? * 1024.0];
        Some(Memory { present_bytes, peak_bytes })
    }
}

/// Vertices with all that the file says of them, indices, and decoded pictures, each once.
fn content_bytes(scene: &Scene) -> usize {
    let meshes = scene.geometries.iter().filter_map(|geometry| match geometry {
        Geometry::Mesh(mesh) => Some(mesh),
        Geometry::Sphere { .. } => None,
    });
    let geometry = meshes.map(|mesh| {
        let shape = size_of_val(&mesh.positions[..]) + size_of_val(&mesh.triangles[..]);
        let looks = size_of_val(&mesh.normals[..]) + size_of_val(&mesh.colors[..]);
        let places: usize = mesh.uvs.iter().map(|uvs| size_of_val(&uvs[..])).sum();
        let bones = mesh.influences.iter();
        let bones = bones.map(|set| size_of_val(&set.joints[..]) + size_of_val(&set.weights[..]));
        let targets = mesh.targets.iter().map(|target| {
            let [positions, normals] = [&target.positions, &target.normals];
            size_of_val(&positions[..])
                + size_of_val(&normals[..])
                + size_of_val(&target.colors[..])
        });
        shape + looks + places + bones.sum::<usize>() + targets.sum::<usize>()
    });
    let pictures = scene.images.iter().map(|image| size_of_val(&image.rgba[..]));
    geometry.sum::<usize>() + pictures.sum::<usize>()
}

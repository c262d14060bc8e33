//! A renderer of one's own in a few lines: here a disc that circles over stripes.
//! Run with `cargo run -p frameless --example closure`; it writes closure.ppm.

use frameless::{
    Batch, Clock, Display, Engine, Function, ReconstructionKind, SamplerKind, Size, Time,
};

/// Linear RGB of image position (x, y), each in [0, 1], at a time in seconds.
fn disc_over_stripes(x: f32, y: f32, secs: f32) -> [f32; 3] {
    let (cx, cy) = (0.5 + 0.3 * secs.cos(), 0.5 + 0.3 * secs.sin());
    match (x - cx).hypot(y - cy) < 0.15 {
        true => [0.9, 0.3, 0.05],
        false => [0.05 + 0.4 * (40.0 * x).sin().abs(); 3],
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let size = Size::new(512, 384);
    let renderer = Function::new(|batch: &Batch| {
        let pixel = |request: &frameless::Request| {
            let [x, y] = request.position_px(batch.size);
            disc_over_stripes(x / 512.0, y / 384.0, batch.scene_secs as f32)
        };
        batch.requests.iter().map(pixel).collect()
    });
    let clock = Clock::simulated(900_000.0);
    let mut engine = Engine::new(size, clock, SamplerKind::default().build(1), renderer);
    // Of a renderer that does not say which surface it hit, `filter` makes the best of it.
    engine.set_reconstruction(ReconstructionKind::Filter.build());
    let end = Time::from_secs(2.0);
    engine.run_until(end)?;

    let mut ppm = format!("P6 {} {} 255\n", size.width, size.height).into_bytes();
    ppm.extend(engine.refresh(end).iter().flatten().map(|&channel| Display::quantize(channel)));
    std::fs::write("closure.ppm", ppm)?;
    Ok(())
}

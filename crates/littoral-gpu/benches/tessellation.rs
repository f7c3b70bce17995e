//! Milliseconds that a tessellation takes on the GPU, over the fixed scene of 2016: relief as large and rough as a globe's, from 300 km up, 1920 × 1080 pixels.
//!
//! `cargo bench -p littoral-gpu --bench tessellation`. The paper's map of 16 384 × 8 192 samples needs 1.1 GB on the device, and a few on the processor; where a
//! processor stands for the device, and where `LITTORAL_GLOBE` asks for other columns, there are fewer samples over the same relief. `alone` is the
//! time by the wall from submission until it is done, `in a row` that of sixteen tessellations in one submission over sixteen, `by its clock` what the device's own
//! timestamps say, all medians; on the processor, its own time for the same triangles. The bytes are the least that any way to do it moves: what is known of the
//! cells that are looked at, and heights, vertices and triangles of what is drawn.
//!
//! Indirect dispatches are checked by wgpu with passes of its own; `WGPU_VALIDATION_INDIRECT_CALL=0` leaves them out.

#[path = "../../littoral/benches/clock/mod.rs"]
mod clock;
#[path = "../../littoral/benches/globe/mod.rs"]
mod globe;
mod timer;

use littoral::lod::{Drawing, Limits, Lod, Patches};
use littoral::space::View;
use littoral_gpu::{Gpu, TessellationPasses, Tessellator};
use std::time::Instant;
use timer::wait;

/// Frames that are measured, after a few that warm up.
const FRAMES: usize = 31;
/// Tessellations in one submission.
const ROW: u32 = 16;

fn main() {
    let gpu = match Gpu::headless() {
        Ok(gpu) => gpu.timed(),
        Err(error) => return println!("{error}"),
    };
    println!("{} ({:?})", gpu.adapter.name, gpu.adapter.backend);
    let asked = std::env::var("LITTORAL_GLOBE").ok().and_then(|columns| columns.parse::<usize>().ok());
    let columns = asked.unwrap_or(if gpu.is_software() { 2048 } else { globe::COLUMNS });
    let columns = columns.next_power_of_two().clamp(1024, globe::COLUMNS);
    let land = globe::land(columns);
    let all = land.finest_level();
    let passes = TessellationPasses::new(&gpu);
    println!("{columns} × {} samples", columns / 2);
    for (finest, tolerance) in [(all - 3, 1.0), (all, 1.0), (all, 0.25), (all, 0.02)] {
        let limits = Limits { finest, triangles: 1_000_000 };
        let view = globe::view(tolerance);
        let start = Instant::now();
        let mut tessellator = match Tessellator::new(&gpu, &passes, &land, limits) {
            Ok(tessellator) => tessellator,
            Err(error) => return println!("{error}"),
        };
        wait(&gpu);
        let made = start.elapsed().as_secs_f64();
        let mut lod = Patches::new(limits);
        let mut drawing = Drawing::default();
        let mut select = || assert!(lod.select(&land, &view, &mut drawing).is_ok());
        select();
        let processor = clock::median(5, select);

        let mut times = [const { Vec::new() }; 3];
        for frame in 0..FRAMES + 4 {
            let alone = submit(&gpu, &mut tessellator, &view, 1);
            let ticks = timer::read(&gpu).unwrap_or(0.0);
            let in_a_row = submit(&gpu, &mut tessellator, &view, ROW) / f64::from(ROW);
            if frame >= 4 {
                times.iter_mut().zip([alone, in_a_row, ticks]).for_each(|(times, taken)| times.push(taken));
            }
        }
        let [alone, in_a_row, ticks] = times.map(|mut times| {
            times.sort_by(f64::total_cmp);
            times[times.len() / 2]
        });
        let told = match tessellator.read(&gpu) {
            Ok(told) => told,
            Err(error) => return println!("{error}"),
        };
        let bytes =
            8 * u64::from(told.looked_at) + (16 + 4) * u64::from(told.vertices) + 12 * u64::from(told.triangles);
        println!(
            "down to level {finest}, {tolerance} pixels asked, {:.2} reached: {} -> {} triangles ({} on the processor), {} cells looked at; made ready in {made:.1} s",
            told.reached.pixels,
            2u64 << (2 * finest - 1),
            told.triangles,
            drawing.triangles(),
            told.looked_at,
        );
        let clock = if gpu.times.is_some() { format!("{ticks:.3} ms by its clock") } else { "no clock".to_owned() };
        println!(
            "  {alone:.3} ms alone, {in_a_row:.3} ms in a row, {clock}; on the processor {:.3} ms; {:.2} MB at least: {:.1} GB/s in a row",
            processor * 1e3,
            1e-6 * bytes as f64,
            1e-6 * bytes as f64 / in_a_row
        );
    }
}

/// Milliseconds from before a number of tessellations are submitted until they are done. One alone is timed by the device's clock, too.
fn submit(gpu: &Gpu, tessellator: &mut Tessellator, view: &View, number: u32) -> f64 {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    for _ in 0..number {
        let timestamps = if number == 1 { timer::writes(gpu) } else { None };
        tessellator.tessellate(gpu, &mut encoder, view, timestamps).expect("a view that the processor took");
    }
    let commands = encoder.finish();
    let start = Instant::now();
    gpu.queue.submit([commands]);
    wait(gpu);
    start.elapsed().as_secs_f64() * 1e3
}

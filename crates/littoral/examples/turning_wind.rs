//! A wind that turns and grows while a program runs, over a shore.
//!
//! Waves over a bed are solved for one wind. When it has changed enough, the next solution is made on a thread of its own, while frames go on
//! with the one there is; then the two are drawn together for some seconds, one fading as the other comes. They know nothing of each
//! other, so it is their squares that add up to 1: the sea is neither lower nor higher on the way, and no height jumps.
//!
//! ```text
//! cargo run --release --example turning_wind            half a minute of frames: their times, and how far heights move in one
//! ```

use glam::DVec2;
use littoral::field::{Sea, Water, coast};
use littoral::waves::SeaState;
use std::error::Error;
use std::f64::consts::FRAC_PI_2;
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

const STEP: f64 = 1.0 / 30.0;
const FRAMES: usize = 900;
/// How long one sea takes to give way to the next (s).
const FADE: f64 = 4.0;

/// The wind: how strong (Beaufort), and whence (rad).
fn wind(seconds: f64) -> (f64, f64) {
    (3.0 + 0.06 * seconds, (200.0 - 1.2 * seconds).to_radians())
}

/// Heights of a sea at an instant.
fn ask(sea: &mut Sea, time: f64, places: &[DVec2], heights: &mut [f64]) {
    sea.set_time(time);
    sea.heights_at(places, heights);
}

fn main() -> Result<(), Box<dyn Error>> {
    let land = Arc::new(coast::coast());
    let water = Arc::new(Water::flood(&land, 0.0).ok_or("the coast has a sea")?);
    let solve = {
        let (land, water) = (land.clone(), water.clone());
        move |seconds: f64, seed: u64| -> Result<Sea, String> {
            let (beaufort, from) = wind(seconds);
            // Waves run where the wind goes.
            let state = SeaState::beaufort(beaufort, -FRAC_PI_2 - from).map_err(|e| e.to_string())?;
            let state = SeaState { seed, ..state };
            // The closure is told how far it is; false ends it.
            Sea::over(&land, &water, &state, &|_| true).map_err(|e| e.to_string())
        }
    };
    // 10 000 places in the bay.
    let (south, size) = (land.origin(), land.extent());
    let places: Vec<DVec2> = (0..10_000)
        .map(|i| south + size * DVec2::new(0.3 + 0.004 * f64::from(i % 100), 0.1 + 0.003 * f64::from(i / 100)))
        .filter(|at| water.covers(*at))
        .collect();
    let (mut now, mut next) = (vec![0.0; places.len()], vec![0.0; places.len()]);
    let mut heights: Vec<f64> = Vec::new();

    let mut sea = solve(0.0, 0)?;
    let (mut coming, mut since): (Option<Sea>, f64) = (None, 0.0);
    // One thread solves, the others are left to the frames.
    let solver = Arc::new(rayon::ThreadPoolBuilder::new().num_threads(1).build()?);
    let (send, receive) = mpsc::channel();
    let (mut solving, mut switches, mut steps) = (false, 0u64, [0.0f64; 2]);
    let mut frames = Vec::with_capacity(FRAMES);
    for frame in 0..FRAMES {
        let (time, begin) = (frame as f64 * STEP, Instant::now());
        if coming.is_none() && !solving {
            let (solve, send, seed) = (solve.clone(), send.clone(), switches + 1);
            // For the wind that will blow when the fade is over.
            solver.spawn(move || drop(send.send(solve(time + FADE, seed))));
            solving = true;
        }
        if let Ok(solved) = receive.try_recv() {
            (coming, since, solving) = (Some(solved?), time, false);
        }
        ask(&mut sea, time, &places, &mut now);
        let share = ((time - since) / FADE).min(1.0);
        let fades = coming.is_some();
        if let Some(sea) = &mut coming {
            ask(sea, time, &places, &mut next);
            let (came, went) = (FRAC_PI_2 * share).sin_cos();
            now.iter_mut().zip(&next).for_each(|(now, next)| *now = *now * went + next * came);
        }
        if share >= 1.0
            && let Some(came) = coming.take()
        {
            sea = came;
            switches += 1;
        }
        let step = heights.iter().zip(&now).map(|(then, now)| (now - then).abs()).fold(0.0, f64::max);
        steps[usize::from(fades)] = steps[usize::from(fades)].max(step);
        heights.clone_from(&now);
        frames.push(begin.elapsed());
        // A program that draws would do so here.
        std::thread::sleep(Duration::from_secs_f64(STEP).saturating_sub(begin.elapsed()));
    }
    frames.sort();
    let square = heights.iter().map(|h| h * h).sum::<f64>() / heights.len() as f64;
    println!(
        "{} heights a frame: {:.1} ms in the median, {:.1} in 99 of 100 frames; {switches} seas gave way to the next; no height moved more than {:.2} m in a frame, nor more than {:.2} m while seas gave way; at the end waves of {:.2} m (significant)",
        heights.len(),
        frames[FRAMES / 2].as_secs_f64() * 1e3,
        frames[FRAMES * 99 / 100].as_secs_f64() * 1e3,
        steps[0],
        steps[1],
        4.0 * square.sqrt()
    );
    Ok(())
}

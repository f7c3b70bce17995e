//! A flight that ends by itself and tells its times.

use super::Flight;
use crate::cockpit::median;
use crate::compare::Difference;
use std::time::Instant;
use winit::event_loop::ActiveEventLoop;

/// What is measured of each frame.
pub struct Smoke {
    frames: u32,
    milliseconds: Vec<f32>,
    method: Vec<f32>,
    triangles: Vec<f32>,
    bound: Vec<f32>,
    /// When it gives up waiting for a first frame.
    begun: Instant,
}

impl Smoke {
    /// Over so many frames.
    pub fn new(frames: u32) -> Smoke {
        Smoke {
            frames,
            milliseconds: Vec::new(),
            method: Vec::new(),
            triangles: Vec::new(),
            bound: Vec::new(),
            begun: Instant::now(),
        }
    }
}

#[derive(serde::Serialize)]
struct Answer {
    frames: u32,
    width: u32,
    height: u32,
    method: &'static str,
    frame_ms: f32,
    method_ms: f32,
    triangles: f32,
    bound_pixels: f32,
    tolerance_pixels: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    difference: Option<Difference>,
    adapter: String,
}

impl Flight {
    /// Counts a frame of a smoke flight, and ends it after the last.
    pub fn count(&mut self, passed: f64, events: &ActiveEventLoop) -> Result<(), String> {
        let Some(smoke) = &mut self.smoke else { return Ok(()) };
        let (Some(frame), Some(_)) = (&self.cockpit.frame, &self.cockpit.scenery) else {
            const PATIENCE: u64 = 300;
            return match smoke.begun.elapsed().as_secs() > PATIENCE {
                true => Err(format!("expected a first picture within {PATIENCE} s, got none; try a smaller file")),
                false => Ok(()),
            };
        };
        smoke.milliseconds.push((passed * 1e3) as f32);
        smoke.method.push(frame.first.milliseconds as f32);
        smoke.triangles.push(frame.first.triangles() as f32);
        smoke.bound.push(frame.first.ground.reached.pixels);
        if smoke.milliseconds.len() as u32 >= smoke.frames {
            let size = self.paint.size();
            let answer = Answer {
                frames: smoke.frames,
                width: size.x,
                height: size.y,
                method: self.cockpit.settings.first.method.name(),
                frame_ms: median(smoke.milliseconds.iter().copied()),
                method_ms: median(smoke.method.iter().copied()),
                triangles: median(smoke.triangles.iter().copied()),
                bound_pixels: median(smoke.bound.iter().copied()),
                tolerance_pixels: self.cockpit.first().tolerance_pixels,
                difference: self.cockpit.difference.filter(|_| self.cockpit.second().is_some()),
                adapter: self.shown.adapter.clone(),
            };
            println!("{}", serde_json::to_string(&answer).map_err(|e| e.to_string())?);
            events.exit();
        }
        Ok(())
    }
}

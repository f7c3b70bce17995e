//! A scene made ready for pictures.

use super::{Picture, Scene, Settings};
use crate::space::{Ray, View};
use glam::{UVec2, Vec2, Vec3};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A scene made ready: built once, good for any number of views.
pub struct Stage<'a> {
    scene: Scene<'a>,
}

impl<'a> Stage<'a> {
    /// Makes `scene` ready.
    pub fn new(scene: &Scene<'a>) -> Stage<'a> {
        Stage { scene: *scene }
    }

    /// What `view` sees. `progress` is told the fraction done, now and then, from any thread.
    pub fn render(&self, view: &View, _settings: &Settings, progress: &(dyn Fn(f32) + Sync)) -> Picture {
        let UVec2 { x: width, y: height } = view.size;
        let pixels = width as usize * height as usize;
        let done = AtomicUsize::new(0);
        let sun = self.scene.sun.direction(self.scene.north).as_vec3();
        let rows: Vec<Vec<([f32; 3], f32, Vec3, Vec3)>> = (0..height)
            .into_par_iter()
            .map(|y| {
                let row = (0..width)
                    .map(|x| {
                        let direction = view.direction(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                        let ray = Ray::new(view.eye, direction.as_dvec3());
                        match self.scene.land.first_hit(&ray) {
                            Some(hit) => {
                                let lit = hit.normal.dot(sun).max(0.0) * 0.8 + 0.2;
                                ([lit, lit * 0.9, lit * 0.8], hit.distance as f32, hit.normal, direction)
                            }
                            None => ([0.4, 0.6, 1.0], f32::INFINITY, Vec3::ZERO, direction),
                        }
                    })
                    .collect();
                progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f32 / height as f32);
                row
            })
            .collect();
        let seen: Vec<_> = rows.into_iter().flatten().collect();
        assert_eq!(seen.len(), pixels);
        Picture {
            size: view.size,
            eye: view.eye,
            radiance: seen.iter().map(|s| s.0).collect(),
            depth: seen.iter().map(|s| s.1).collect(),
            normal: seen.iter().map(|s| s.2.to_array()).collect(),
            position: seen.iter().map(|s| (s.3 * s.1).to_array()).collect(),
            height: seen
                .iter()
                .map(|s| if s.1.is_finite() { view.eye.z as f32 + s.3.z * s.1 } else { f32::NAN })
                .collect(),
            coverage: seen.iter().map(|s| f32::from(u8::from(s.1.is_finite()))).collect(),
        }
    }
}

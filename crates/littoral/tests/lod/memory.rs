//! Warm calls allocate nothing.

use super::counting::allocations;
use super::{METHODS, Random, random_land};
use glam::{DVec2, UVec2};
use littoral::lod::{Drawing, Limits};
use littoral::space::View;

#[test]
fn warm_calls_allocate_nothing() {
    let mut random = Random::new(3);
    let surface = random_land(65, 65, &mut random);
    let flight = |step: u32| {
        let at = surface.origin + surface.extent * DVec2::new(0.2 + 0.01 * f64::from(step), 0.4);
        let mut view =
            View::looking_at(at.extend(80.0), (at + DVec2::new(50.0, 20.0)).extend(40.0), 1.0, UVec2::new(640, 360));
        view.tolerance_pixels = 4.0;
        view
    };
    for method in METHODS {
        let limits = Limits { finest: surface.finest, triangles: 20_000 };
        let (mut lod, mut drawing) = ((method.make)(limits), Drawing::default());
        let mut fly = |drawing: &mut Drawing| {
            for step in 0..20 {
                lod.select(&*surface.field, &flight(step), drawing).expect("a view");
                drawing.expand(&*surface.field);
            }
        };
        fly(&mut drawing);
        fly(&mut drawing);
        let before = allocations();
        fly(&mut drawing);
        assert_eq!(allocations() - before, 0, "{}: allocations on the third flight", method.name);
    }
}

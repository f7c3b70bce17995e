//! Warm calls allocate nothing.

use super::{METHODS, Random, random_land};
use glam::{DVec2, UVec2};
use littoral::lod::{Drawing, Limits};
use littoral::space::View;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// The system's allocator, counting what each thread asks for.
struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = COUNT.try_with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's promises are those of `System`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(at, layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        let _ = COUNT.try_with(|count| count.set(count.get() + 1));
        // SAFETY: as above.
        unsafe { System.realloc(at, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

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
        let before = COUNT.get();
        fly(&mut drawing);
        assert_eq!(COUNT.get() - before, 0, "{}: allocations on the third flight", method.name);
    }
}

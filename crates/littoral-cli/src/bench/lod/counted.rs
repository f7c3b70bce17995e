//! What methods cost beside time: memory, and heights asked for.

use littoral::field::{HeightField, HeightRange};
use littoral::space::{Cell, Datum, Place};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// The system's allocator, counting what is held.
struct Counting;

static HELD: AtomicUsize = AtomicUsize::new(0);

/// Bytes of memory that the program holds.
pub fn held() -> usize {
    HELD.load(Relaxed)
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        HELD.fetch_add(layout.size(), Relaxed);
        // SAFETY: the caller's promises are those of `System`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        HELD.fetch_add(layout.size(), Relaxed);
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(at, layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        HELD.fetch_add(size, Relaxed);
        HELD.fetch_sub(layout.size(), Relaxed);
        // SAFETY: as above.
        unsafe { System.realloc(at, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A field that counts the heights it is asked for.
pub struct Counted<'a> {
    field: &'a dyn HeightField,
    heights: AtomicUsize,
}

impl<'a> Counted<'a> {
    pub fn new(field: &'a dyn HeightField) -> Counted<'a> {
        Counted { field, heights: AtomicUsize::new(0) }
    }

    /// How many it was asked for.
    pub fn heights_asked(&self) -> usize {
        self.heights.load(Relaxed)
    }
}

impl HeightField for Counted<'_> {
    fn datum(&self) -> Datum {
        self.field.datum()
    }

    fn height(&self, at: Place) -> Option<f32> {
        self.heights.fetch_add(1, Relaxed);
        self.field.height(at)
    }

    fn range(&self, cell: Cell) -> HeightRange {
        self.field.range(cell)
    }

    fn error(&self, cell: Cell) -> f32 {
        self.field.error(cell)
    }

    fn stencil_error(&self, cell: Cell, depth: u8) -> f32 {
        self.field.stencil_error(cell, depth)
    }

    fn fill(&self, cell: Cell, side: usize, heights: &mut [f32]) {
        self.heights.fetch_add(heights.len(), Relaxed);
        self.field.fill(cell, side, heights);
    }

    fn heights(&self, places: &[Place], heights: &mut [f32]) {
        self.heights.fetch_add(places.len(), Relaxed);
        self.field.heights(places, heights);
    }
}

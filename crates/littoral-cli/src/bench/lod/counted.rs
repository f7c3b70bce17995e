//! What methods cost beside time: memory, and heights asked for.

use littoral::field::{HeightField, HeightRange, Vertex};
use littoral::space::{Cell, Datum, Place};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicBool, AtomicIsize, AtomicUsize, Ordering::Relaxed};

/// The system's allocator, counting what is held while it is asked to.
struct Counting;

/// Whether it counts: other commands pay for a look at this, not for a number that all threads write.
static COUNTS: AtomicBool = AtomicBool::new(false);
static HELD: AtomicIsize = AtomicIsize::new(0);

/// Begins to count.
pub fn count() {
    COUNTS.store(true, Relaxed);
}

/// Bytes of memory that the program took less those it gave back since it began to count.
pub fn held() -> isize {
    HELD.load(Relaxed)
}

fn add(bytes: isize) {
    if COUNTS.load(Relaxed) {
        HELD.fetch_add(bytes, Relaxed);
    }
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        add(layout.size() as isize);
        // SAFETY: the caller's promises are those of `System`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        add(layout.size() as isize);
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        add(-(layout.size() as isize));
        // SAFETY: as above.
        unsafe { System.dealloc(at, layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        add(size as isize - layout.size() as isize);
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

    fn row(&self, first: Cell, ranges: &mut [HeightRange], errors: &mut [f32]) {
        self.field.row(first, ranges, errors);
    }

    fn errors(&self, first: Cell, columns: usize, errors: &mut [f32]) {
        self.field.errors(first, columns, errors);
    }

    fn fill(&self, cell: Cell, side: usize, heights: &mut [f32]) {
        self.heights.fetch_add(heights.len(), Relaxed);
        self.field.fill(cell, side, heights);
    }

    fn heights(&self, places: &[Place], heights: &mut [f32]) {
        self.heights.fetch_add(places.len(), Relaxed);
        self.field.heights(places, heights);
    }

    fn raise(&self, face: u8, points: &[[u32; 2]], vertices: &mut Vec<Vertex>) {
        self.heights.fetch_add(points.len(), Relaxed);
        self.field.raise(face, points, vertices);
    }
}

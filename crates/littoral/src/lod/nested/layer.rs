//! What is drawn of a window: bits for its cells and vertices, row by row, so that rectangles and rows are dealt with at once.

use super::super::drawing::coarse_ends;
use super::window::Window;

/// A vertex that is not drawn.
pub(super) const NONE: u32 = u32::MAX;

/// Bits in a word.
const WORD: u32 = u64::BITS;

/// Cells and vertices of a window that are drawn.
#[derive(Clone, Debug, Default)]
pub(super) struct Layer {
    pub window: Window,
    /// How many cells are drawn.
    pub count: usize,
    /// Words in a row.
    words: usize,
    cells: Vec<u64>,
    vertices: Vec<u64>,
    /// For each word of `vertices`: the place in the mesh of its first vertex.
    numbers: Vec<u32>,
}

/// The bits set in a word, from the lowest.
fn ones(mut word: u64) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        (word != 0).then(|| {
            let bit = word.trailing_zeros();
            word &= word - 1;
            bit
        })
    })
}

/// The bits `from..to` of all words of a row that hold any of them.
fn masks(from: u32, to: u32) -> impl Iterator<Item = (usize, u64)> {
    (from / WORD..to.div_ceil(WORD)).map(move |word| {
        let first = word * WORD;
        let low = u64::MAX << from.saturating_sub(first);
        let high = u64::MAX >> (first + WORD).saturating_sub(to);
        (word as usize, low & high)
    })
}

impl Layer {
    /// Begins a window of which nothing is drawn yet.
    pub fn start(&mut self, window: Window) {
        self.window = window;
        self.words = (window.side / WORD + 1) as usize;
        self.cells.clear();
        self.cells.resize(self.words * window.side as usize, 0);
    }

    /// Draws the cells of a rectangle, from one corner to another.
    pub fn draw(&mut self, low: [u32; 2], high: [u32; 2]) {
        for j in low[1]..high[1] {
            masks(low[0], high[0]).for_each(|(word, mask)| self.cells[j as usize * self.words + word] |= mask);
        }
    }

    /// Counts what is drawn.
    pub fn finish(&mut self) {
        self.count = self.cells.iter().map(|word| word.count_ones() as usize).sum();
    }

    /// Leaves out a hole.
    pub fn cut(&mut self, ring: Window) {
        self.window = ring;
        if let Some([x, y]) = ring.hole {
            for j in y..y + ring.half {
                masks(x, x + ring.half).for_each(|(word, mask)| self.cells[j as usize * self.words + word] &= !mask);
            }
        }
        self.finish();
    }

    /// Whether a cell is drawn.
    pub fn is_drawn(&self, i: u32, j: u32) -> bool {
        i < self.window.side
            && j < self.window.side
            && self.cells[j as usize * self.words + (i / WORD) as usize] >> (i % WORD) & 1 == 1
    }

    /// Whether the coarser window's cell beyond a vertex of a side (south, east, north, west) is drawn.
    pub fn is_drawn_beyond(&self, coarser: &Layer, i: u32, j: u32, side: usize) -> bool {
        let (x, y) = ((self.window.x + i) / 2 - coarser.window.x, (self.window.y + j) / 2 - coarser.window.y);
        match side {
            0 => y > 0 && coarser.is_drawn(x, y - 1),
            3 => x > 0 && coarser.is_drawn(x - 1, y),
            _ => coarser.is_drawn(x, y),
        }
    }

    /// Marks the vertices of the cells that are drawn, and, nearer than `zone` to the border, those that they move towards or that end the coarser edges.
    pub fn mark_vertices(&mut self, zone: u32) {
        let (words, side) = (self.words, self.window.side as usize);
        self.vertices.clear();
        self.vertices.resize(words * (side + 1), 0);
        for j in 0..=side {
            let mut carry = 0;
            for word in 0..words {
                let south = if j > 0 { self.cells[(j - 1) * words + word] } else { 0 };
                let cells = south | if j < side { self.cells[j * words + word] } else { 0 };
                self.vertices[j * words + word] = cells | cells << 1 | carry;
                carry = cells >> (WORD - 1);
            }
        }
        if zone == 0 {
            return;
        }
        for j in 0..=self.window.side {
            for word in 0..words {
                for bit in self.near(zone, j, word) {
                    for (i, j) in coarse_ends(word as u32 * WORD + bit, j) {
                        self.vertices[j as usize * words + (i / WORD) as usize] |= 1 << (i % WORD);
                    }
                }
            }
        }
    }

    /// The bits of a word of vertices that are nearer than `zone` to the border.
    fn near(&self, zone: u32, j: u32, word: usize) -> impl Iterator<Item = u32> + use<> {
        let (window, first) = (self.window, word as u32 * WORD);
        let [south, east, north, west] = window.inner_sides();
        let row = (south && j < zone) || (north && window.side - j < zone);
        let column = (west && first < zone) || (east && window.side < first + WORD - 1 + zone);
        let bits = if row || column { self.vertices[j as usize * self.words + word] } else { 0 };
        ones(bits).filter(move |bit| window.depth(first + bit, j) < zone)
    }

    /// Numbers the vertices, beginning with `first`, and tells each one's column and row.
    pub fn number(&mut self, first: u32, mut tell: impl FnMut(u32, u32)) {
        self.numbers.clear();
        let mut next = first;
        for (at, &bits) in self.vertices.iter().enumerate() {
            self.numbers.push(next);
            next += bits.count_ones();
            let (j, word) = ((at / self.words) as u32, (at % self.words) as u32);
            ones(bits).for_each(|bit| tell(word * WORD + bit, j));
        }
    }

    /// The place of a vertex in the mesh; [`NONE`] if it is not drawn.
    pub fn vertex(&self, i: u32, j: u32) -> u32 {
        let (at, bit) = (j as usize * self.words + (i / WORD) as usize, i % WORD);
        let bits = self.vertices[at];
        if bits >> bit & 1 == 0 {
            return NONE;
        }
        self.numbers[at] + (bits & ((1 << bit) - 1)).count_ones()
    }

    /// Tells column, row and place of the vertices nearer than `zone` to the border.
    pub fn near_border(&self, zone: u32, mut tell: impl FnMut(u32, u32, u32)) {
        for j in 0..=self.window.side {
            for word in 0..self.words {
                for bit in self.near(zone, j, word) {
                    let i = word as u32 * WORD + bit;
                    tell(i, j, self.vertex(i, j));
                }
            }
        }
    }

    /// Tells row, first and last column (that one excluded) of cells that are drawn and follow each other.
    pub fn runs(&self, mut tell: impl FnMut(u32, u32, u32)) {
        for (at, &bits) in self.cells.iter().enumerate() {
            let (j, first) = ((at / self.words) as u32, (at % self.words) as u32 * WORD);
            let mut bits = bits;
            while bits != 0 {
                let from = bits.trailing_zeros();
                let count = (!(bits >> from)).trailing_zeros();
                tell(j, first + from, first + from + count);
                // In two steps, since a word may be full.
                bits = if from + count >= WORD { 0 } else { bits >> (from + count) << (from + count) };
            }
        }
    }
}

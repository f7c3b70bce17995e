//! The marks of a wedge, gathered as bits ring by ring and written as the raster's rows.
//!
//! Rings that are columns would be written one byte here and one far away: sixteen rings at a time they are bytes side by
//! side.

use super::frame::{BATCH, Frame, Ring};

/// The caller's marks, written from many threads, each sample by the one wedge that owns it.
pub(super) struct Seen {
    marks: *mut u8,
    len: usize,
}

// SAFETY: wedges partition the samples (every border between two is computed by both from the same numbers), so that no
// two threads write the same byte, and none reads.
unsafe impl Sync for Seen {}

impl Seen {
    pub fn new(marks: &mut [u8]) -> Seen {
        Seen { marks: marks.as_mut_ptr(), len: marks.len() }
    }

    /// # Safety
    /// No other thread may write the same samples.
    #[inline(always)]
    unsafe fn write(&self, index: usize, marks: &[u8]) {
        assert!(index + marks.len() <= self.len, "marks beyond the raster");
        // SAFETY: within the caller's array; no other thread writes here.
        unsafe { std::ptr::copy_nonoverlapping(marks.as_ptr(), self.marks.add(index), marks.len()) };
    }
}

/// The marks of a batch of rings: a bit for each sample of each ring.
#[derive(Default)]
pub(super) struct Marks {
    /// Minor coordinate of the first bit, and bytes to a ring.
    low: i64,
    stride: usize,
    bits: Vec<u8>,
    /// The first and last bit that may be set.
    range: (usize, usize),
}

impl Marks {
    /// Turns to a batch of rings whose rows begin at the minor coordinate `low` and hold `length` samples.
    pub fn turn(&mut self, low: i64, length: usize) {
        self.low = low;
        self.stride = length / 8 + 8;
        self.bits.clear();
        self.bits.resize(self.stride * BATCH, 0);
        self.range = (usize::MAX, 0);
    }

    /// Marks samples of ring `k` of the batch from the minor coordinate `from` on, lowest bit first.
    #[inline(always)]
    pub fn add(&mut self, k: usize, from: i64, mask: u32) {
        if mask == 0 {
            return;
        }
        let at = (from - self.low) as usize;
        self.range = (self.range.0.min(at), self.range.1.max(at + 31));
        let bytes = &mut self.bits[k * self.stride + at / 8..][..4];
        let before = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        bytes.copy_from_slice(&(before | mask << (at & 7)).to_le_bytes());
    }

    /// Sixteen bits of ring `k` from bit 16·`block` on.
    #[inline(always)]
    fn word(&self, k: usize, block: usize) -> u16 {
        let at = k * self.stride + 2 * block;
        u16::from_le_bytes([self.bits[at], self.bits[at + 1]])
    }

    /// Writes what was marked and returns how many samples that are. `rings` are the batch's, the one before first;
    /// `edges` the directions that border the wedge: blocks wholly inside are written at once.
    ///
    /// # Safety
    /// All marks must be of samples of this wedge.
    #[inline(always)]
    pub unsafe fn write(&self, frame: &Frame, rings: &[Ring], edges: (f64, f64), seen: &Seen) -> usize {
        if self.range.0 > self.range.1 {
            return 0;
        }
        let rings = &rings[1..];
        // What is inside on all rings; one sample less on each side, for rounding.
        let (mut inside_low, mut inside_high) = (i64::MIN, i64::MAX);
        for ring in rings {
            let (from, to) = (frame.eye_minor + edges.0 * ring.distance, frame.eye_minor + edges.1 * ring.distance);
            inside_low = inside_low.max(from.ceil() as i64 + 1).max(ring.belonging.0);
            inside_high = inside_high.min(to.floor() as i64 - 1).min(ring.belonging.1);
        }
        let mut count = 0;
        for block in self.range.0 / 16..=self.range.1.min(8 * self.stride - 17) / 16 {
            let low = self.low + 16 * block as i64;
            let mut words = [0u16; BATCH];
            let mut any = 0;
            for (k, word) in words.iter_mut().enumerate().take(rings.len()) {
                *word = self.word(k, block);
                any |= *word;
            }
            if any == 0 {
                continue;
            }
            count += words.iter().map(|word| word.count_ones() as usize).sum::<usize>();
            let whole = low >= inside_low && low + 16 <= inside_high && rings.len() == BATCH;
            if !whole {
                for (word, ring) in words.iter().zip(rings) {
                    let mut bits = *word;
                    while bits != 0 {
                        let index = frame.index(frame.major(ring.ring), low + i64::from(bits.trailing_zeros()));
                        // SAFETY: the sample belongs to this wedge.
                        unsafe { seen.write(index, &[255]) };
                        bits &= bits - 1;
                    }
                }
                continue;
            }
            let across = if frame.eastward { turned(words) } else { words };
            let backward = if frame.eastward { !frame.forward } else { !frame.rising };
            for (k, word) in across.iter().enumerate().filter(|(_, word)| **word != 0) {
                let word = if backward { word.reverse_bits() } else { *word };
                let (low_eight, high_eight) = (spread(word as u8), spread((word >> 8) as u8));
                let marks = (u128::from(low_eight) | u128::from(high_eight) << 64).to_le_bytes();
                let last = if backward { 15 } else { 0 };
                let index = if frame.eastward {
                    frame.index(frame.major(rings[last].ring), low + k as i64)
                } else {
                    frame.index(frame.major(rings[k].ring), low + last as i64)
                };
                // SAFETY: all sixteen belong to this wedge.
                unsafe { seen.write(index, &marks) };
            }
        }
        count
    }
}

/// Eight bits as eight bytes of 0 or 255, lowest first.
#[inline(always)]
fn spread(bits: u8) -> u64 {
    let each = u64::from(bits).wrapping_mul(0x0101_0101_0101_0101) & 0x8040_2010_0804_0201;
    let ones = (each.wrapping_add(0x7F7F_7F7F_7F7F_7F7F) | each) & 0x8080_8080_8080_8080;
    (ones >> 7) * 255
}

/// The bit matrix turned over its diagonal: bit j of row i becomes bit i of row j.
#[inline(always)]
fn turned(mut rows: [u16; 16]) -> [u16; 16] {
    for (step, mask) in [(8, 0x00FFu16), (4, 0x0F0F), (2, 0x3333), (1, 0x5555)] {
        for low in (0..16).filter(|row| row & step == 0) {
            let exchange = (rows[low] >> step ^ rows[low + step]) & mask;
            rows[low] ^= exchange << step;
            rows[low + step] ^= exchange;
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_become_bytes() {
        for bits in 0..=255u8 {
            let bytes = spread(bits).to_le_bytes();
            for (k, byte) in bytes.iter().enumerate() {
                assert_eq!(*byte, if bits >> k & 1 == 1 { 255 } else { 0 }, "bit {k} of {bits:08b}");
            }
        }
    }

    #[test]
    fn turning_exchanges_rows_and_columns() {
        let mut state = 1u64;
        let rows: [u16; 16] = std::array::from_fn(|_| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as u16
        });
        let columns = turned(rows);
        for (i, row) in rows.iter().enumerate() {
            for (j, column) in columns.iter().enumerate() {
                assert_eq!(row >> j & 1, column >> i & 1, "row {i}, column {j}");
            }
        }
    }
}

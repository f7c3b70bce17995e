//! The mesh in place: triangles without gaps between them in memory, and which parts of it changed.

use super::*;

/// Which parts of a mesh changed, in blocks.
#[derive(Clone, Debug, Default)]
pub(super) struct Changes {
    pub triangles: Vec<u64>,
    pub vertices: Vec<u64>,
}

/// Triangles or vertices a block.
const BLOCK: usize = 64;

impl Changes {
    #[inline]
    pub fn mark(blocks: &mut Vec<u64>, at: u32) {
        let block = at as usize / BLOCK;
        if block / 64 >= blocks.len() {
            blocks.resize(block / 64 + 1, 0);
        }
        blocks[block / 64] |= 1 << (block % 64);
    }

    pub fn clear(&mut self) {
        self.triangles.fill(0);
        self.vertices.fill(0);
    }

    pub fn ranges(blocks: &[u64], len: usize) -> impl Iterator<Item = Range<usize>> + '_ {
        let marked = move |block: usize| blocks.get(block / 64).is_some_and(|word| word >> (block % 64) & 1 == 1);
        let mut block = 0;
        std::iter::from_fn(move || {
            while block * BLOCK < len && !marked(block) {
                block += 1;
            }
            let from = block;
            while block * BLOCK < len && marked(block) {
                block += 1;
            }
            (from < block).then(|| from * BLOCK..(block * BLOCK).min(len))
        })
    }
}
impl<G: Ground> RoamFlight<'_, G> {
    /// Draws the triangle of a diamond on the side of one of its parents, whose vertex is `apex`.
    pub(super) fn draw(&mut self, record: u32, diamond: Diamond, side: usize, apex: u32) {
        let known = self.records[record as usize];
        if !known.bound.whole(side) {
            return;
        }
        let [a, b] = known.ends;
        // Clockwise by the order of the base's ends?
        let towards = diamond.apexes()[side].expect("a triangle on this side");
        let turned = match diamond.base {
            Base::Rising | Base::North => towards[0] > diamond.at[0],
            Base::Falling => towards[0] < diamond.at[0],
            Base::East => towards[1] < diamond.at[1],
        };
        self.put(record, side, if turned { [b, a, apex] } else { [a, b, apex] });
    }

    /// Adds a triangle of a diamond.
    #[inline(always)]
    pub(super) fn put(&mut self, record: u32, side: usize, triangle: [u32; 3]) {
        let owner = 2 * record + side as u32;
        let slot = match self.freed.pop() {
            Some(slot) => {
                self.mesh.triangles[slot as usize] = triangle;
                self.owners[slot as usize] = owner;
                slot
            }
            None => {
                self.mesh.triangles.push(triangle);
                self.owners.push(owner);
                self.owners.len() as u32 - 1
            }
        };
        Changes::mark(&mut self.changed.triangles, slot);
        self.records[record as usize].triangles[side] = slot;
    }

    /// Closes the gaps that merges left among the triangles.
    pub(super) fn compact(&mut self) {
        self.freed.sort_unstable();
        while let Some(slot) = self.freed.pop() {
            let owner = self.owners.pop().expect("as many owners as triangles");
            let triangle = self.mesh.triangles.pop().expect("freed triangles are there");
            if (slot as usize) < self.owners.len() {
                self.owners[slot as usize] = owner;
                self.mesh.triangles[slot as usize] = triangle;
                self.records[owner as usize / 2].triangles[owner as usize & 1] = slot;
                Changes::mark(&mut self.changed.triangles, slot);
            }
        }
    }
}

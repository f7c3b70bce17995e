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
        let turned = usize::from(diamond.turned(side));
        self.put(record, side, [[a, b][turned], [a, b][1 - turned], apex]);
    }

    /// Adds a triangle of a diamond; its apex comes last.
    #[inline(always)]
    pub(super) fn put(&mut self, record: u32, side: usize, triangle: [u32; 3]) {
        let slot = match self.freed.pop() {
            Some(slot) => {
                self.mesh.triangles[slot as usize] = triangle;
                slot
            }
            None => {
                self.mesh.triangles.push(triangle);
                self.mesh.triangles.len() as u32 - 1
            }
        };
        Changes::mark(&mut self.changed.triangles, slot);
        self.records[record as usize].triangles[side] = slot;
    }

    /// Whose triangle it is: a record and a side. Asked only where triangles become fewer, so that splits need not write it down.
    fn owner(&self, [a, b, apex]: [u32; 3]) -> (u32, usize) {
        let parent = self.makers[apex as usize];
        if parent == NONE {
            return (0, usize::from(apex != 1));
        }
        let [a, b] = [a, b].map(|vertex| self.mesh.vertices[vertex as usize]);
        let middle = [a.x.midpoint(b.x), a.y.midpoint(b.y)];
        let known = &self.records[parent as usize];
        let diamond = Diamond::at(known.at);
        let child = (0..4).find(|&i| diamond.child(i).is_some_and(|child| child.at == middle));
        let child = known.children[child.expect("a triangle's apex made the middle of its base")];
        (child, usize::from(self.records[child as usize].parents[0] != parent))
    }

    /// Closes the gaps that merges left among the triangles.
    pub(super) fn compact(&mut self) {
        self.freed.sort_unstable();
        while let Some(slot) = self.freed.pop() {
            let triangle = self.mesh.triangles.pop().expect("freed triangles are there");
            if (slot as usize) < self.mesh.triangles.len() {
                let (record, side) = self.owner(triangle);
                self.mesh.triangles[slot as usize] = triangle;
                self.records[record as usize].triangles[side] = slot;
                Changes::mark(&mut self.changed.triangles, slot);
            }
        }
    }
}

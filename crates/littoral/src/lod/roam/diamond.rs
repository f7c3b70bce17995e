//! The bintree by its vertices: who splits what, told by integers.
//!
//! Every triangle of the bintree is bisected at the middle of its base, and the two triangles that share a base (a *diamond*) are bisected
//! together. So a diamond has a name, the lattice point in the middle of its base, and a mesh is the set of diamonds that are split. Two kinds
//! take turns: the base of a *square* diamond is a diagonal of a cell of the quadtree, that of a *side* diamond a side of one. A diamond can be
//! split when both of its triangles are there, each made by the split of a *parent*, whose middle is the triangle's apex:
//!
//! ```text
//!    square of a cell          side of a cell
//!    M₂──────B                     P'
//!    │     ╱ │                   ╱   ╲
//!    │   v   │                  a──v──b
//!    │ ╱     │                   ╲   ╱
//!    A──────M₁                     P
//! ```
//!
//! The parents of a cell's middle v are the two corners M that its diagonal misses; those of a side's middle are the middles P of the
//! cells on both sides. A mesh without T-vertices is a set of diamonds that holds the parents of each of its members.

use crate::space::Cell;

/// Steps of the lattice along a face's side.
pub(super) const STEPS: u32 = 1 << Cell::MAX_LEVEL;

/// The finest cells whose middles lie on the lattice.
pub(super) const FINEST: u8 = Cell::MAX_LEVEL - 1;

/// A point of the lattice.
pub(super) type Point = [u32; 2];

/// A diamond, named by the middle of its base.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Diamond {
    /// The middle of the base.
    pub at: Point,
    /// Half a cell's side.
    pub half: u32,
    /// Which way the base runs.
    pub base: Base,
}

/// Which way the base of a diamond runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Base {
    /// Along a cell's diagonal, northward to the east.
    Rising,
    /// Along a cell's diagonal, southward to the east.
    Falling,
    /// Along a side, eastward.
    East,
    /// Along a side, northward.
    North,
}

impl Diamond {
    /// The diamond of the whole face.
    pub const ROOT: Diamond = Diamond { at: [STEPS / 2; 2], half: STEPS / 2, base: Base::Rising };

    /// The diamond whose base has its middle at a point that is no corner of the face.
    #[inline(always)]
    pub fn at(at: Point) -> Diamond {
        // Looked up, since no processor foresees which way the next one's base runs.
        const BASES: [Base; 8] = {
            use Base::{East, Falling, North, Rising};
            [North, East, North, Rising, North, East, North, Falling]
        };
        let zeros = (at[0] | at[1]).trailing_zeros();
        let [x, y] = [at[0] >> zeros, at[1] >> zeros];
        let base = BASES[(x & 1 | (y & 1) << 1 | ((x ^ y) & 2) << 1) as usize];
        Diamond { at, half: 1 << zeros, base }
    }

    /// Whether the base is a cell's diagonal.
    #[inline]
    pub fn is_square(self) -> bool {
        matches!(self.base, Base::Rising | Base::Falling)
    }

    /// Level of the cell whose diagonal or side the base is.
    #[inline]
    pub fn cell_level(self) -> u8 {
        Cell::MAX_LEVEL - 1 - self.half.trailing_zeros() as u8
    }

    /// Depth in the bintree, 0 for the whole face: parents have a smaller one.
    #[inline]
    pub fn level(self) -> u8 {
        2 * self.cell_level() + u8::from(!self.is_square())
    }

    /// A number that no other diamond has.
    #[inline]
    pub fn name(self) -> u64 {
        u64::from(self.at[0]) << 32 | u64::from(self.at[1])
    }

    #[inline(always)]
    fn shifted(self, by: [i32; 2]) -> Option<Point> {
        let [x, y] = [self.at[0].wrapping_add_signed(by[0]), self.at[1].wrapping_add_signed(by[1])];
        (x <= STEPS && y <= STEPS).then_some([x, y])
    }

    /// The ends of the base.
    #[inline]
    pub fn ends(self) -> [Point; 2] {
        let h = self.half;
        let [x, y] = self.at;
        match self.base {
            Base::Rising => [[x - h, y - h], [x + h, y + h]],
            Base::Falling => [[x - h, y + h], [x + h, y - h]],
            Base::East => [[x - h, y], [x + h, y]],
            Base::North => [[x, y - h], [x, y + h]],
        }
    }

    /// The apexes of its two triangles; the second is missing at the face's border. Except for the whole face they are its parents.
    #[inline]
    pub fn apexes(self) -> [Option<Point>; 2] {
        let h = self.half as i32;
        let both = match self.base {
            Base::Rising => [[h, -h], [-h, h]],
            Base::Falling => [[h, h], [-h, -h]],
            Base::East => [[0, h], [0, -h]],
            Base::North => [[-h, 0], [h, 0]],
        };
        match [self.shifted(both[0]), self.shifted(both[1])] {
            [None, second] => [second, None],
            both => both,
        }
    }

    /// The diamonds that must be split before this one.
    #[inline]
    pub fn parents(self) -> [Option<Diamond>; 2] {
        if self == Diamond::ROOT { [None; 2] } else { self.apexes().map(|apex| apex.map(Diamond::at)) }
    }

    /// The diamonds that this one is a parent of.
    #[inline]
    pub fn children(self) -> [Option<Diamond>; 4] {
        [0, 1, 2, 3].map(|i| self.child(i))
    }

    /// One of them: four at once are written to memory, and read before they have arrived there.
    #[inline(always)]
    pub fn child(self, i: usize) -> Option<Diamond> {
        const TO: [[[i32; 2]; 4]; 2] = [[[0, -1], [1, 0], [0, 1], [-1, 0]], [[-1, -1], [1, -1], [1, 1], [-1, 1]]];
        const BASES: [Base; 4] = [Base::Rising, Base::Falling, Base::East, Base::North];
        let of_side = u32::from(!self.is_square());
        let half = self.half >> of_side;
        let at = self.shifted(TO[of_side as usize][i].map(|step| step * half as i32))?;
        let zeros = half.checked_ilog2()?;
        let falling = (at[0] ^ at[1]) >> zeros >> 1 & 1;
        let base = BASES[if of_side == 1 { falling as usize } else { 2 + (i & 1) }];
        Some(Diamond { at, half, base })
    }

    /// Which of a child's parents this is, in the order of its [`Diamond::apexes`], but at the border of the face.
    #[inline(always)]
    pub fn side_of(self, child: usize) -> usize {
        let sides = if self.is_square() { 0b1100 } else { 0b0110 };
        sides >> child & 1
    }

    /// The way to a child's other parent: through which of this diamond's parents, and as which child of that. To the other parent the child is the one
    /// opposite, `child ^ 2`.
    #[inline(always)]
    pub fn beyond(self, child: usize) -> (usize, usize) {
        // By the order of bases.
        const THROUGH: [[u8; 4]; 4] = [[0, 0, 1, 1], [1, 0, 0, 1], [1, 1, 0, 0], [0, 1, 1, 0]];
        const AS: [[u8; 4]; 4] = [[0, 2, 2, 0], [1, 1, 3, 3], [3, 1, 1, 3], [0, 0, 2, 2]];
        let base = self.base as usize;
        (usize::from(THROUGH[base][child]), usize::from(AS[base][child]))
    }

    /// The ends of a child's base, among this diamond's two ends and two apexes.
    #[inline(always)]
    pub fn child_ends<T: Copy>(self, known: [T; 4], child: usize) -> [T; 2] {
        const ENDS: [[[u8; 2]; 4]; 4] = [
            [[0, 2], [2, 1], [3, 1], [0, 3]],
            [[3, 1], [1, 2], [0, 2], [3, 0]],
            [[0, 3], [3, 1], [2, 1], [0, 2]],
            [[2, 0], [0, 3], [1, 3], [2, 1]],
        ];
        ENDS[self.base as usize][child].map(|at| known[usize::from(at)])
    }

    /// Whether its triangle on a side runs clockwise by the order of the base's ends.
    #[inline(always)]
    pub fn turned(self, side: usize) -> bool {
        let [x, y] = self.at;
        // There the side that is missing is the first.
        let shifted = self.base == Base::East && y == STEPS || self.base == Base::North && x == 0;
        (self.base == Base::Rising) ^ (side == 1) ^ shifted
    }

    /// The cell whose diagonal the base is, or that lies on the side of `apex`.
    pub fn cell(self, apex: Point) -> Cell {
        let middle = if self.is_square() { self.at } else { apex };
        let level = self.cell_level();
        let [x, y] = middle.map(|c| c >> (Cell::MAX_LEVEL - level));
        Cell { face: 0, level, x, y }
    }

    /// The corners of its triangle towards `apex`, counter-clockwise.
    pub fn triangle(self, apex: Point) -> [Point; 3] {
        let [a, b] = self.ends();
        let [a64, b64, c64] = [a, b, apex].map(|p| p.map(i64::from));
        let area = (b64[0] - a64[0]) * (c64[1] - a64[1]) - (b64[1] - a64[1]) * (c64[0] - a64[0]);
        if area > 0 { [a, b, apex] } else { [b, a, apex] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parents_and_children_agree() {
        let mut level = vec![Diamond::ROOT];
        for depth in 0..12 {
            let mut next = Vec::new();
            for diamond in &level {
                assert_eq!(diamond.level(), depth);
                for child in diamond.children().into_iter().flatten() {
                    assert!(child.parents().contains(&Some(*diamond)), "{child:?} of {diamond:?}");
                    assert!(child.triangle(diamond.at).iter().all(|p| p.iter().all(|&c| c <= STEPS)));
                    next.push(child);
                }
            }
            next.sort_by_key(|d| d.name());
            next.dedup();
            // Middles of cells: a fourth of their samples; middles of sides: both ways, and one more at the border.
            let cells = 1u64 << (next[0].cell_level());
            let expected = if next[0].is_square() { cells * cells } else { 2 * cells * (cells + 1) };
            assert_eq!(next.len() as u64, expected);
            for diamond in &next {
                for parent in diamond.parents().into_iter().flatten() {
                    assert!(parent.children().contains(&Some(*diamond)));
                }
            }
            level = next;
        }
    }
}

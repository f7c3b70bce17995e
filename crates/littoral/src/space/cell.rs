//! Names for places and squares on a datum.

use glam::DVec2;

/// A point of the datum's surface: a face and a position on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Which face: always 0 on a plane, 0 to 5 on an ellipsoid.
    pub face: u8,
    /// Position on the face, each coordinate in [0, 1]: u eastward, v northward on a plane.
    pub uv: DVec2,
}

/// A square of a face's quadtree: the face divided into 2^`level` × 2^`level` cells.
///
/// A value, not a reference: integers say *which*, exactly, so that neighbours agree to the bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Cell {
    /// Which face: always 0 on a plane, 0 to 5 on an ellipsoid.
    pub face: u8,
    /// Depth in the quadtree, 0 (the whole face) to [`Cell::MAX_LEVEL`].
    pub level: u8,
    /// Column from the west, in [0, 2^level).
    pub x: u32,
    /// Row from the south, in [0, 2^level).
    pub y: u32,
}

impl Cell {
    /// The finest level: 2³⁰ steps a side, 9 mm on an Earth-sized cube face.
    pub const MAX_LEVEL: u8 = 30;

    /// The whole of a face.
    pub const fn face(face: u8) -> Cell {
        Cell { face, level: 0, x: 0, y: 0 }
    }

    /// The four quarters: south-west, south-east, north-west, north-east.
    ///
    /// # Panics
    /// At [`Cell::MAX_LEVEL`], which has no children.
    pub fn children(self) -> [Cell; 4] {
        assert!(self.level < Cell::MAX_LEVEL, "a cell of the finest level has no children");
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| Cell {
            face: self.face,
            level: self.level + 1,
            x: 2 * self.x + i,
            y: 2 * self.y + j,
        })
    }

    /// The cell this one is a quarter of; `None` for a whole face.
    pub fn parent(self) -> Option<Cell> {
        (self.level > 0).then(|| Cell { face: self.face, level: self.level - 1, x: self.x / 2, y: self.y / 2 })
    }

    /// Side length in uv: 2^−level.
    pub fn side(self) -> f64 {
        1.0 / (1u64 << self.level) as f64
    }

    /// The south-west corner.
    pub fn low_corner(self) -> Place {
        Place { face: self.face, uv: DVec2::new(f64::from(self.x), f64::from(self.y)) * self.side() }
    }

    /// The middle.
    pub fn centre(self) -> Place {
        Place { face: self.face, uv: DVec2::new(f64::from(self.x) + 0.5, f64::from(self.y) + 0.5) * self.side() }
    }

    /// The cell of `level` that holds `place`; places on the far edges belong to the last cell.
    pub fn containing(place: Place, level: u8) -> Cell {
        let count = f64::from(1u32 << level);
        let index = (place.uv * count).floor().clamp(DVec2::ZERO, DVec2::splat(count - 1.0));
        Cell { face: place.face, level, x: index.x as u32, y: index.y as u32 }
    }

    /// Whether `other` lies within this cell (a cell contains itself).
    pub fn contains(self, other: Cell) -> bool {
        other.face == self.face
            && other.level >= self.level
            && other.x >> (other.level - self.level) == self.x
            && other.y >> (other.level - self.level) == self.y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn children_partition_their_parent() {
        let cell = Cell { face: 3, level: 5, x: 17, y: 30 };
        for (i, child) in cell.children().into_iter().enumerate() {
            assert_eq!(child.parent(), Some(cell));
            assert!(cell.contains(child) && !child.contains(cell));
            assert_eq!(Cell::containing(child.centre(), child.level), child);
            assert_eq!(Cell::containing(child.centre(), cell.level), cell);
            assert_eq!(cell.children().iter().position(|&c| c == child), Some(i));
        }
        assert_eq!(Cell::face(2).parent(), None);
    }

    #[test]
    fn the_far_edge_belongs_to_the_last_cell() {
        let edge = Place { face: 0, uv: DVec2::ONE };
        assert_eq!(Cell::containing(edge, 4), Cell { face: 0, level: 4, x: 15, y: 15 });
    }
}

//! A Delaunay triangulation that grows sample by sample: half-edges in flat arrays, exact predicates on integers.
//!
//! Half-edge 3t + i leads from corner i of triangle t to the next; its twin leads back in the neighbour. Fixed half-edges are
//! never flipped. Work this rests on: C. Lawson, "Software for C¹ surface interpolation", 1977 (insertion by flips).

use crate::mesh::measure::in_circle;

/// No half-edge: the border of the raster.
pub(super) const NONE: u32 = u32::MAX;

/// Bits 0 to 2 of a triangle's flags: its half-edges that are fixed.
pub(super) const FIXED: u8 = 1;
/// The triangle has changed since it was last looked at.
pub(super) const CHANGED: u8 = 8;
/// The triangle lies on no surface.
pub(super) const OUTSIDE: u8 = 16;

type At = [u32; 2];

#[derive(Clone, Debug, Default)]
pub(super) struct Net {
    pub vertices: Vec<At>,
    pub corners: Vec<u32>,
    pub twins: Vec<u32>,
    pub flags: Vec<u8>,
    /// Triangles that the last insertion changed or made; some may be named several times.
    pub touched: Vec<u32>,
    pending: Vec<u32>,
    /// Whether all samples are so near each other that 64 bits hold what tells circles apart.
    small: bool,
}

#[inline(always)]
pub(super) fn next(edge: u32) -> u32 {
    if edge % 3 == 2 { edge - 2 } else { edge + 1 }
}

#[inline(always)]
pub(super) fn previous(edge: u32) -> u32 {
    if edge.is_multiple_of(3) { edge + 2 } else { edge - 1 }
}

/// Twice the area of a triangle, positive when it turns counter-clockwise.
#[inline(always)]
fn turn(a: At, b: At, c: At) -> i64 {
    let (ax, ay) = (i64::from(a[0]), i64::from(a[1]));
    (i64::from(b[0]) - ax) * (i64::from(c[1]) - ay) - (i64::from(b[1]) - ay) * (i64::from(c[0]) - ax)
}

impl Net {
    /// Two triangles over a rectangle of samples.
    pub fn over(last: At) -> Net {
        let small = last[0].max(last[1]) < 1 << 14;
        let vertices = vec![[0, 0], [last[0], 0], last, [0, last[1]]];
        let twins = vec![NONE, NONE, 3, 2, NONE, NONE];
        Net { vertices, corners: vec![0, 1, 2, 0, 2, 3], twins, flags: vec![CHANGED; 2], small, ..Net::default() }
    }

    pub fn triangles(&self) -> usize {
        self.flags.len()
    }

    #[inline(always)]
    pub fn at(&self, edge: u32) -> At {
        self.vertices[self.corners[edge as usize] as usize]
    }

    #[inline(always)]
    pub fn triangle(&self, triangle: u32) -> [At; 3] {
        [0, 1, 2].map(|i| self.at(3 * triangle + i))
    }

    pub fn fixed(&self, edge: u32) -> bool {
        self.flags[edge as usize / 3] >> (edge % 3) & FIXED != 0
    }

    fn fix(&mut self, edge: u32, fixed: bool) {
        let flags = &mut self.flags[edge as usize / 3];
        *flags = (*flags & !(FIXED << (edge % 3))) | u8::from(fixed) << (edge % 3);
    }

    /// Fixes an edge and its twin.
    pub fn fix_edge(&mut self, edge: u32) {
        self.fix(edge, true);
        if self.twins[edge as usize] != NONE {
            self.fix(self.twins[edge as usize], true);
        }
    }

    /// The triangle that a sample lies in or on the border of, from a triangle near it.
    pub fn locate(&self, at: At, near: u32) -> u32 {
        let mut edge = 3 * near;
        let mut left = 3;
        while left > 0 {
            if turn(self.at(edge), self.at(next(edge)), at) < 0 {
                edge = self.twins[edge as usize];
                left = 2;
                edge = next(edge);
            } else {
                left -= 1;
                edge = next(edge);
            }
        }
        edge / 3
    }

    /// Makes a sample a vertex, which lies in or on the border of a triangle and is none yet, and flips edges until the
    /// triangulation is Delaunay but for fixed ones. False where it is a corner of the triangle.
    pub fn insert(&mut self, at: At, triangle: u32) -> bool {
        self.touched.clear();
        let vertex = self.vertices.len() as u32;
        let edges = [3 * triangle, 3 * triangle + 1, 3 * triangle + 2];
        if edges.iter().any(|&edge| self.at(edge) == at) {
            return false;
        }
        self.vertices.push(at);
        match edges.into_iter().find(|&edge| turn(self.at(edge), self.at(next(edge)), at) == 0) {
            Some(edge) => self.split_edge(edge, vertex),
            None => self.split_triangle(triangle, vertex),
        }
        while let Some(edge) = self.pending.pop() {
            self.legalise(edge);
        }
        true
    }

    /// One more triangle.
    fn push(&mut self, corners: [u32; 3], flags: u8) -> u32 {
        let triangle = self.flags.len() as u32;
        self.corners.extend(corners);
        self.twins.extend([NONE; 3]);
        self.flags.push(flags | CHANGED);
        self.touched.push(triangle);
        triangle
    }

    #[inline(always)]
    fn link(&mut self, a: u32, b: u32) {
        if a != NONE {
            self.twins[a as usize] = b;
        }
        if b != NONE {
            self.twins[b as usize] = a;
        }
    }

    fn touch(&mut self, triangle: u32) {
        self.flags[triangle as usize] |= CHANGED;
        self.touched.push(triangle);
    }

    fn split_triangle(&mut self, t: u32, p: u32) {
        let [e, f, g] = [3 * t, 3 * t + 1, 3 * t + 2];
        let [a, b, c] = [e, f, g].map(|edge| self.corners[edge as usize]);
        let (outer_f, outer_g) = (self.twins[f as usize], self.twins[g as usize]);
        let (fixed_f, fixed_g) = (self.fixed(f), self.fixed(g));
        let kind = self.flags[t as usize] & OUTSIDE;
        let u = self.push([b, c, p], kind);
        let v = self.push([c, a, p], kind);
        self.corners[g as usize] = p;
        self.touch(t);
        self.link(3 * u, outer_f);
        self.link(3 * v, outer_g);
        self.link(f, 3 * u + 2);
        self.link(3 * u + 1, 3 * v + 2);
        self.link(3 * v + 1, g);
        self.fix(3 * u, fixed_f);
        self.fix(3 * v, fixed_g);
        self.fix(f, false);
        self.fix(g, false);
        self.pending.extend([e, 3 * u, 3 * v]);
    }

    /// Splits the one or two triangles at an edge.
    fn split_edge(&mut self, e: u32, p: u32) {
        let twin = self.twins[e as usize];
        let fixed = self.fixed(e);
        // (a, b, c) becomes (a, p, c) and (p, b, c).
        let half = |net: &mut Net, e: u32| {
            let (f, b) = (next(e), net.corners[next(e) as usize]);
            let c = net.corners[previous(e) as usize];
            let (outer, outer_fixed) = (net.twins[f as usize], net.fixed(f));
            let new = net.push([p, b, c], net.flags[e as usize / 3] & OUTSIDE);
            net.corners[f as usize] = p;
            net.touch(e / 3);
            net.link(3 * new + 1, outer);
            net.fix(3 * new + 1, outer_fixed);
            net.link(f, 3 * new + 2);
            net.fix(f, false);
            net.fix(3 * new, fixed);
            net.pending.extend([previous(e), 3 * new + 1]);
            new
        };
        let first = half(self, e);
        if twin != NONE {
            let second = half(self, twin);
            // e now leads from a to p, the twin from b to p.
            self.link(e, 3 * second);
            self.link(twin, 3 * first);
        } else {
            self.twins[3 * first as usize] = NONE;
        }
    }

    /// Flips an edge if the corner beyond it lies within the circle around this triangle.
    fn legalise(&mut self, edge: u32) {
        let twin = self.twins[edge as usize];
        if twin == NONE || self.fixed(edge) {
            return;
        }
        let (forward, back, beyond) = (next(edge), previous(edge), previous(twin));
        let circle = [self.at(edge), self.at(forward), self.at(back)];
        if !self.within(circle, self.at(beyond)) {
            return;
        }
        let onward = next(twin);
        let (p, q) = (self.corners[back as usize], self.corners[beyond as usize]);
        let (outer, outer_fixed) = (self.twins[onward as usize], self.fixed(onward));
        let (inner, inner_fixed) = (self.twins[forward as usize], self.fixed(forward));
        self.corners[forward as usize] = q;
        self.corners[onward as usize] = p;
        self.link(edge, outer);
        self.fix(edge, outer_fixed);
        self.link(twin, inner);
        self.fix(twin, inner_fixed);
        self.link(forward, onward);
        self.fix(forward, false);
        self.fix(onward, false);
        self.touch(edge / 3);
        self.touch(twin / 3);
        self.pending.extend([edge, beyond]);
    }

    #[inline(always)]
    fn within(&self, [a, b, c]: [At; 3], d: At) -> bool {
        if !self.small {
            return in_circle([a, b, c], d);
        }
        let from = |p: At| [0, 1].map(|axis| i64::from(p[axis] as i32 - d[axis] as i32));
        let ([ax, ay], [bx, by], [cx, cy]) = (from(a), from(b), from(c));
        let square = |x: i64, y: i64| x * x + y * y;
        square(ax, ay) * (bx * cy - by * cx) - square(bx, by) * (ax * cy - ay * cx)
            + square(cx, cy) * (ax * by - ay * bx)
            > 0
    }
}

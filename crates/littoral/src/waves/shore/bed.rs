//! The sea bed that waves run over, as depths on a grid.

use super::super::OutOfRange;
use glam::DVec2;

/// Fewest and most nodes a side.
const SIDE: std::ops::RangeInclusive<usize> = 2..=16_384;
/// Most nodes altogether.
const NODES: usize = 1 << 26;

/// A sea bed: depths below still water on a regular grid, and which nodes are sea.
#[derive(Clone, Debug, PartialEq)]
pub struct Bed {
    origin: DVec2,
    spacing: DVec2,
    columns: usize,
    rows: usize,
    depths: Vec<f32>,
}

impl Bed {
    /// A bed from `columns` × `rows` depths (m below still water, negative on land; NaN, a void, counts as land), southern row first.
    /// `origin` is the place of the first node (m), `spacing` the distances between nodes (m). Waves reach the nodes that `water` marks, and of
    /// those only the ones that lie deeper than 0; the caller tells the sea from hollows behind dikes (say by a flood from the open edge).
    ///
    /// # Errors
    /// If the sizes do not fit one another, are absurd, or no node is under water.
    pub fn new(
        origin: DVec2,
        spacing: DVec2,
        columns: usize,
        rows: usize,
        mut depths: Vec<f32>,
        water: impl Fn(usize) -> bool,
    ) -> Result<Bed, OutOfRange> {
        Bed::check(origin, spacing, columns, rows)?;
        OutOfRange::unless(
            depths.len() == columns * rows,
            "depths of a bed",
            "as many as columns × rows",
            depths.len() as f64,
        )?;
        let mut wet = 0;
        for (index, depth) in depths.iter_mut().enumerate() {
            if !depth.is_finite() {
                *depth = if *depth == f32::INFINITY { 12e3 } else { DRY };
            }
            *depth = depth.clamp(-12e3, 12e3);
            if *depth > 0.0 && !water(index) {
                *depth = DRY;
            }
            wet += usize::from(*depth > 0.0);
        }
        let expected = "at least one node below still water, in the sea; lower the land, or do not ask for waves";
        OutOfRange::unless(wet > 0, "nodes of the bed under water", expected, 0.0)?;
        Ok(Bed { origin, spacing, columns, rows, depths })
    }

    /// A bed from a function of the place that gives depths (m; negative or NaN on land), all of it sea.
    ///
    /// # Errors
    /// As [`Bed::new`].
    pub fn of(
        origin: DVec2,
        spacing: DVec2,
        columns: usize,
        rows: usize,
        depth: impl Fn(DVec2) -> f64,
    ) -> Result<Bed, OutOfRange> {
        Bed::check(origin, spacing, columns, rows)?;
        let place = |i: usize| origin + spacing * DVec2::new((i % columns) as f64, (i / columns) as f64);
        let depths = (0..columns * rows).map(|i| depth(place(i)) as f32).collect();
        Bed::new(origin, spacing, columns, rows, depths, |_| true)
    }

    /// The designer's bed: a shoreline, and how the bed falls off from it. The land lies to the left of one who walks along `line` (at least
    /// two points, m), and rises as the bed falls. The bed falls by `slope` (m per m) down to `floor` (m); where a `surf` is given, the first
    /// stretch falls as slowly as makes waves of its height break over all of its width.
    ///
    /// # Errors
    /// If the line has no length, a number makes no sense, or as [`Bed::new`].
    pub fn of_shoreline(
        line: &[DVec2],
        slope: f64,
        surf: Option<Surf>,
        floor: f64,
        frame: Frame,
    ) -> Result<Bed, OutOfRange> {
        OutOfRange::unless(slope > 0.0 && slope <= 10.0, "slope of the bed", "m per m, above 0 and at most 10", slope)?;
        OutOfRange::unless(floor > 0.0 && floor <= 12e3, "depth off the shore", "m, above 0 and at most 12000", floor)?;
        let finite = line.iter().all(|p| p.is_finite());
        let length: f64 = line.windows(2).map(|w| w[0].distance(w[1])).sum();
        let expected = "at least two points that are not one";
        OutOfRange::unless(finite && length > 0.0, "length of the shoreline", expected, length)?;
        let (width, at_break) = match surf {
            Some(Surf { width, height }) => {
                OutOfRange::unless(
                    width > 0.0 && width < 1e5,
                    "width of the surf",
                    "m, above 0 and below 100000",
                    width,
                )?;
                OutOfRange::unless(
                    height > 0.0 && height < 50.0,
                    "height of the surf",
                    "m, above 0 and below 50",
                    height,
                )?;
                (width, height / f64::from(super::BREAKING))
            }
            None => (0.0, 0.0),
        };
        let depth = |at: DVec2| {
            let d = seaward(line, at);
            let inner = if width > 0.0 { at_break * (d / width).clamp(-1.0, 1.0) } else { 0.0 };
            let outer = slope * (d.abs() - width).max(0.0) * d.signum();
            (inner + outer).min(floor)
        };
        Bed::of(frame.origin, frame.spacing, frame.columns, frame.rows, depth)
    }

    fn check(origin: DVec2, spacing: DVec2, columns: usize, rows: usize) -> Result<(), OutOfRange> {
        OutOfRange::unless(origin.is_finite(), "origin of the bed", "finite metres", origin.x + origin.y)?;
        for step in [spacing.x, spacing.y] {
            OutOfRange::unless((1e-3..=1e5).contains(&step), "spacing of the bed", "m, from 0.001 to 100000", step)?;
        }
        for side in [columns, rows] {
            OutOfRange::unless(SIDE.contains(&side), "nodes a side of the bed", "from 2 to 16384", side as f64)?;
        }
        OutOfRange::unless(columns * rows <= NODES, "nodes of the bed", "at most 2²⁶", (columns * rows) as f64)
    }

    /// Place of the first node (m).
    pub fn origin(&self) -> DVec2 {
        self.origin
    }

    /// Distances between nodes (m).
    pub fn spacing(&self) -> DVec2 {
        self.spacing
    }

    /// Nodes along x.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Nodes along y.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Mean depth (m) of the water along the border of the grid, or of all of it where the border is dry: what suits as the depth of the
    /// sea off the bed, so that waves come to it unbent.
    pub fn edge_depth(&self) -> f64 {
        let mean = |wanted: &dyn Fn(usize) -> bool| {
            let wet = |&i: &usize| self.depths[i] > 0.0 && wanted(i);
            let (sum, count) = (0..self.depths.len())
                .filter(wet)
                .fold((0.0, 0usize), |(s, n), i| (s + f64::from(self.depths[i]), n + 1));
            (count > 0).then(|| sum / count as f64)
        };
        let border = |i: usize| {
            let (c, r) = (i % self.columns, i / self.columns);
            c == 0 || r == 0 || c == self.columns - 1 || r == self.rows - 1
        };
        mean(&border).or_else(|| mean(&|_| true)).unwrap_or(1.0)
    }

    /// Depths (m), row by row from the south; at most 0 on land. Never NaN.
    pub fn depths(&self) -> &[f32] {
        &self.depths
    }
}

/// Height (m) of land of which nothing is known but that it is none of the sea.
const DRY: f32 = -1.0;

/// Where a grid lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Place of the first node (m).
    pub origin: DVec2,
    /// Distances between nodes (m).
    pub spacing: DVec2,
    /// Nodes along x.
    pub columns: usize,
    /// Nodes along y.
    pub rows: usize,
}

/// A surf as a designer wants it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surf {
    /// Width of the surf (m), above 0.
    pub width: f64,
    /// Significant height (m) of the waves that break at its outer edge.
    pub height: f64,
}

/// Distance (m) from a line; positive to its right.
fn seaward(line: &[DVec2], at: DVec2) -> f64 {
    let mut nearest = f64::INFINITY;
    let mut side = 0.0;
    for w in line.windows(2) {
        let along = w[1] - w[0];
        let length = along.length_squared();
        if length <= 0.0 {
            continue;
        }
        let t = ((at - w[0]).dot(along) / length).clamp(0.0, 1.0);
        let away = at - (w[0] + along * t);
        let distance = away.length();
        // Where two legs are equally near, the one that is seen squarer knows the side.
        let turn = away.perp_dot(along) / length.sqrt();
        if distance < nearest - 1e-9 || (distance < nearest + 1e-9 && turn.abs() > f64::abs(side)) {
            nearest = nearest.min(distance);
            side = turn;
        }
    }
    if side < 0.0 { -nearest } else { nearest }
}

//! One drawing held against what was promised.

use super::{Random, Surface};
use glam::{DVec2, DVec3};
use littoral::field::HeightField;
use littoral::lod::{Drawing, Limits, Lod, Mesh, ScreenMetric};
use littoral::space::{Cell, Place, View};
use std::collections::HashMap;

pub struct Case<'a> {
    pub surface: &'a Surface,
    pub view: &'a View,
    pub limits: Limits,
    pub label: &'a str,
}

/// The triangles of a drawing in an order of their own: what is drawn, however it is stored.
pub fn sorted(drawing: &Drawing) -> Vec<[(u32, u32, u32, u32); 3]> {
    let mesh = &drawing.mesh;
    let mut triangles: Vec<_> = mesh
        .triangles
        .iter()
        .map(|t| {
            let corners = t.map(|i| {
                let v = mesh.vertices[i as usize];
                (v.face, v.x, v.y, v.height.to_bits())
            });
            let first = (0..3).min_by_key(|&i| corners[i]).expect("three");
            [corners[first], corners[(first + 1) % 3], corners[(first + 2) % 3]]
        })
        .collect();
    triangles.sort_unstable();
    triangles
}

type Point = (i64, i64);

struct Triangle {
    at: [Point; 3],
    height: [f64; 3],
    low: Point,
    high: Point,
}

impl Triangle {
    fn area(&self) -> i128 {
        let [a, b, c] = self.at.map(|(x, y)| (i128::from(x), i128::from(y)));
        (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0)
    }

    /// The height over a point in lattice steps, if it lies within.
    fn height_over(&self, p: DVec2) -> Option<f64> {
        if p.x < self.low.0 as f64 || p.x > self.high.0 as f64 || p.y < self.low.1 as f64 || p.y > self.high.1 as f64 {
            return None;
        }
        let [a, b, c] = self.at.map(|(x, y)| DVec2::new(x as f64, y as f64));
        let area = (b - a).perp_dot(c - a);
        if area == 0.0 {
            return None;
        }
        let (wa, wb, wc) =
            ((b - p).perp_dot(c - p) / area, (c - p).perp_dot(a - p) / area, (a - p).perp_dot(b - p) / area);
        (wa >= 0.0 && wb >= 0.0 && wc >= 0.0).then(|| wa * self.height[0] + wb * self.height[1] + wc * self.height[2])
    }
}

const STEPS: f64 = (1u32 << Cell::MAX_LEVEL) as f64;

fn triangles(mesh: &Mesh, label: &str) -> Vec<Triangle> {
    let triangle = |t: &[u32; 3]| {
        let v = t.map(|i| mesh.vertices[i as usize]);
        assert!(v.iter().all(|v| v.height.is_finite()), "{label}: a height of {:?}", v.map(|v| v.height));
        let at = v.map(|v| (i64::from(v.x), i64::from(v.y)));
        let low = (at.iter().map(|p| p.0).min().expect("three"), at.iter().map(|p| p.1).min().expect("three"));
        let high = (at.iter().map(|p| p.0).max().expect("three"), at.iter().map(|p| p.1).max().expect("three"));
        assert!(low.0 >= 0 && low.1 >= 0 && high.0 <= STEPS as i64 && high.1 <= STEPS as i64, "{label}: off the face");
        let triangle = Triangle { at, height: v.map(|v| f64::from(v.height)), low, high };
        assert!(triangle.area() >= 0, "{label}: {at:?} is clockwise");
        triangle
    };
    mesh.triangles.iter().map(triangle).collect()
}

/// Selects what the case asks for and holds it against every promise.
pub fn check(lod: &mut dyn Lod, case: &Case, random: &mut Random) {
    let (field, label) = (&*case.surface.field, case.label);
    let mut drawing = Drawing::default();
    let reached = lod.select(field, case.view, &mut drawing).unwrap_or_else(|e| panic!("{label}: {e}"));
    let tolerance = case.view.tolerance_pixels;
    assert!(reached.pixels >= 0.0, "{label}: {reached:?}");
    assert!(reached.limited || reached.pixels <= tolerance, "{label}: {reached:?} for {tolerance} pixels");
    drawing.expand(field);
    let drawn = triangles(&drawing.mesh, label);
    let sight = Sight { field, view: case.view, metric: ScreenMetric::new(case.view, field.datum()).expect("a view") };

    // Partly void cells may be left out where they are no larger than what was reached.
    let small = tolerance.max(reached.pixels) * 1.02;

    // One height at each point, so that what meets in plan meets in space.
    let mut heights: HashMap<Point, f64> = HashMap::new();
    for t in &drawn {
        for (at, height) in t.at.iter().zip(t.height) {
            let first = *heights.entry(*at).or_insert(height);
            assert!(first == height, "{label}: {at:?} is drawn at {first} and at {height} m");
        }
    }

    // Every edge has a triangle on both sides, unless nothing is to be drawn beyond it.
    let mut edges: HashMap<(Point, Point), i32> = HashMap::new();
    for t in &drawn {
        for (a, b) in [(0, 1), (1, 2), (2, 0)].map(|(i, j)| (t.at[i], t.at[j])) {
            *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    let mut open: Vec<_> = edges.iter().filter(|(_, n)| **n != 0).map(|(&(a, b), &n)| (a, b, n)).collect();
    open.sort_unstable();
    let every = open.len().div_ceil(400);
    for &(a, b, n) in open.iter().skip(random.below(every.max(1) as u32) as usize).step_by(every.max(1)) {
        assert!(n.abs() == 1, "{label}: {n} triangles more on one side of {a:?}–{b:?} than on the other");
        let (from, to) = if n > 0 { (a, b) } else { (b, a) };
        let [from, to] = [from, to].map(|(x, y)| DVec2::new(x as f64, y as f64));
        let out = -(to - from).perp().normalize() * 0.25;
        for part in [0.07, 0.5, 0.81] {
            // Edges out of sight may gape.
            let at = from.lerp(to, part);
            let (start, end) = if n > 0 { (heights[&a], heights[&b]) } else { (heights[&b], heights[&a]) };
            if !sight.seen(sight.world(at, start + (end - start) * part)) {
                continue;
            }
            let beyond = at + out;
            assert!(
                !drawn.iter().any(|t| t.height_over(beyond).is_some()),
                "{label}: a crack along {a:?}–{b:?} at {part}"
            );
            assert!(!sight.needs(beyond, small), "{label}: nothing drawn beyond {a:?}–{b:?} at {part}");
        }
    }

    // Points that are seen are covered once, as near to their place as was said.
    let allowed = reached.pixels.max(tolerance.min(reached.pixels)) * 1.02 + 1e-3;
    let check_point = |p: DVec2, t: &Triangle| {
        let Some(drawn) = t.height_over(p) else { return };
        let Some(surface) = sight.height(p) else { return };
        // Far off, a point may be drawn where the frame does not reach, nor the bound.
        if reached.limited && !sight.seen(sight.world(p, drawn)) {
            return;
        }
        if let Some(off) = sight.off(p, surface, drawn) {
            let rounding = sight.off(p, surface, surface + 2e-6 * surface.abs().max(1.0)).unwrap_or(0.0);
            assert!(
                off <= allowed + rounding,
                "{label}: at {:?} drawn {drawn} for {surface} m, {off} pixels off where {reached:?} was said",
                p / STEPS
            );
        }
    };
    if let (Some((columns, rows)), true) = (case.surface.samples, reached.pixels.is_finite()) {
        // Every sample of the raster.
        let step = STEPS / f64::from(((columns.max(rows) - 1) as u32).next_power_of_two());
        for t in &drawn {
            let index =
                |at: i64, up: bool| if up { (at as f64 / step).ceil() } else { (at as f64 / step).floor() } as i64;
            for j in index(t.low.1, true)..=index(t.high.1, false) {
                for i in index(t.low.0, true)..=index(t.high.0, false) {
                    check_point(DVec2::new(i as f64, j as f64) * step, t);
                }
            }
        }
    }
    let wanted = |p: DVec2| {
        let over: Vec<&Triangle> = drawn.iter().filter(|t| t.height_over(p).is_some()).collect();
        if over.is_empty() {
            assert!(!sight.needs(p, small), "{label}: nothing drawn at {:?}", p / STEPS);
        }
        assert!(over.len() <= 1, "{label}: {:?} is covered {} times", p / STEPS, over.len());
        if reached.pixels.is_finite() {
            over.iter().for_each(|t| check_point(p, t));
        }
    };
    for _ in 0..30 {
        wanted(DVec2::new(random.unit(), random.unit()) * STEPS);
        if !drawn.is_empty() {
            let t = &drawn[random.below(drawn.len() as u32) as usize];
            let [a, b, c] = t.at.map(|(x, y)| DVec2::new(x as f64, y as f64));
            let (u, v) = (random.unit().sqrt(), random.unit());
            if t.area() > 0 {
                wanted(a * (1.0 - u) + b * (u * (1.0 - v)) + c * (u * v));
            }
        }
    }
    assert!(
        drawn.len() <= case.limits.triangles.max(64) * 2,
        "{label}: {} triangles for {}",
        drawn.len(),
        case.limits.triangles
    );
}

/// What the eye would see of the surface itself.
struct Sight<'a> {
    field: &'a dyn HeightField,
    view: &'a View,
    metric: ScreenMetric,
}

impl Sight<'_> {
    fn height(&self, p: DVec2) -> Option<f64> {
        self.field.height(Place { face: 0, uv: p / STEPS }).map(f64::from)
    }

    fn world(&self, p: DVec2, height: f64) -> DVec3 {
        self.field.datum().world(Place { face: 0, uv: p / STEPS }, height).0
    }

    /// Whether a point in space is well within the frame.
    fn seen(&self, world: DVec3) -> bool {
        let depth = self.view.clip_from_eye.row(3).truncate().dot((world - self.view.eye).as_vec3());
        let size = self.view.size.as_vec2();
        depth > 1.01 * View::NEAR
            && self.view.pixel(world).is_some_and(|at| at.cmpgt(size * 0.001).all() && at.cmplt(size * 0.999).all())
    }

    /// Whether something has to be drawn at a point: there is a surface, and it is seen; and no cell there that is partly void is so small that it may
    /// be left out.
    fn needs(&self, p: DVec2, small: f32) -> bool {
        let inside = p.cmpge(DVec2::ZERO).all() && p.cmple(DVec2::splat(STEPS)).all();
        if !inside || !self.height(p).is_some_and(|h| self.seen(self.world(p, h))) {
            return false;
        }
        // On a line between cells the surface may be that of either.
        let nudges = [(0.0, 0.0), (-0.1, -0.1), (0.1, -0.1), (-0.1, 0.1), (0.1, 0.1)];
        !nudges.into_iter().map(|(i, j)| Place { face: 0, uv: (p + DVec2::new(i, j)) / STEPS }).any(|place| {
            (0..=Cell::MAX_LEVEL).any(|level| {
                let cell = Cell::containing(place, level);
                self.field.error(cell).is_infinite()
                    && self.metric.cell(self.field, cell, f32::INFINITY).is_none_or(|(_, pixels)| pixels <= small)
            })
        })
    }

    /// How far a point of the surface is from its place on the screen when drawn at another height (pixels); `None` if it is not seen.
    fn off(&self, p: DVec2, surface: f64, drawn: f64) -> Option<f32> {
        let true_place = self.world(p, surface);
        if !self.seen(true_place) {
            return None;
        }
        let off = self.view.pixel(true_place)?.distance(self.view.pixel(self.world(p, drawn))?);
        Some(off)
    }
}

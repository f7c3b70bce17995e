//! Pictures of meshes: what a detail method draws, seen through the same light as the surface itself.
//!
//! The mesh is rasterised: its triangles are sorted into tiles of the picture, and each is tried against the rays through the pixels it may
//! cover. A ray d from the eye meets the triangle (a, b, c) if d·(a × b), d·(b × c) and d·(c × a) have one sign, and does so at the distance
//! a·(b × c) / d·(a × b + b × c + c × a). Two triangles that share an edge compute the same product for it but for its sign, so that no ray
//! slips between them (J. Kensler and P. Shirley, "Optimizing ray–triangle intersection via automated search", 2006, on such edge tests).
//!
//! Everything else (light, shadows, mirrors, air) is that of the exact surface: a picture of a mesh differs from the exact one by the mesh alone.

use super::stage::{Caster, Stage};
use super::{Drape, Picture, Settings, Style};
use crate::field::{HeightField, Land, Sea};
use crate::lod::Mesh;
use crate::raycast::{LocalRay, RayCaster};
use crate::space::{Datum, View};
use glam::{DVec3, UVec2, Vec2, Vec3};
use rayon::prelude::*;

/// Meshes to be seen instead of the surfaces they stand for.
#[derive(Clone, Copy, Debug, Default)]
pub struct Meshes<'a> {
    /// Of the ground as the stage draws it ([`Stage::land`]).
    pub ground: Option<&'a Mesh>,
    /// Of the sea ([`Sea`] as a height field).
    pub water: Option<&'a Mesh>,
    /// Whether edges are drawn over the picture.
    pub wireframe: bool,
}

/// Side of the tiles that triangles are sorted into (pixels).
const TILE: u32 = 16;

/// A mesh as one view sees it.
pub(super) struct Drawn {
    /// Vertices from the eye (m).
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// First and last column and row of pixels that a triangle may cover.
    boxes: Vec<[u32; 4]>,
    /// Triangles by tile: where each tile's begin in `sorted`.
    starts: Vec<u32>,
    sorted: Vec<u32>,
    tiles: UVec2,
    view: View,
}

/// A triangle ready to be met by rays from the eye.
struct Facet {
    /// Normals of the planes through the eye and each edge.
    sides: [DVec3; 3],
    volume: f64,
}

impl Facet {
    fn new([a, b, c]: [DVec3; 3]) -> Facet {
        let sides = [a.cross(b), b.cross(c), c.cross(a)];
        Facet { sides, volume: a.dot(sides[1]) }
    }

    /// Distance to it along a ray from the eye.
    fn hit(&self, direction: DVec3) -> Option<f64> {
        let s = self.sides.map(|side| direction.dot(side));
        let inside = (s[0] >= 0.0 && s[1] >= 0.0 && s[2] >= 0.0) || (s[0] <= 0.0 && s[1] <= 0.0 && s[2] <= 0.0);
        let distance = self.volume / (s[0] + s[1] + s[2]);
        (inside && distance > 0.0 && distance.is_finite()).then_some(distance)
    }
}

impl Drawn {
    /// Sorts a mesh on `datum` into the tiles of a view's picture.
    pub fn new(mesh: &Mesh, datum: &Datum, view: &View) -> Drawn {
        let vertices = mesh
            .vertices
            .par_iter()
            .map(|v| if v.height.is_nan() { DVec3::ZERO } else { v.world(datum) - view.eye })
            .collect();
        Drawn::of(vertices, mesh.triangles.clone(), view)
    }

    /// Sorts triangles over vertices, these from the eye (m), into the tiles of a view's picture.
    pub fn of(vertices: Vec<DVec3>, triangles: Vec<[u32; 3]>, view: &View) -> Drawn {
        let last = view.size.saturating_sub(UVec2::ONE);
        let cover = |triangle: &[u32; 3]| cover(view, triangle.map(|i| vertices[i as usize]), last);
        let boxes: Vec<[u32; 4]> = triangles.par_iter().map(cover).collect();
        let tiles = UVec2::new(view.size.x.div_ceil(TILE), view.size.y.div_ceil(TILE));
        let touched = |cover: &[u32; 4]| {
            let [left, right, top, bottom] = cover.map(|at| at / TILE);
            // An empty box touches nothing.
            let none = cover[0] > cover[1] || cover[2] > cover[3];
            let rows = if none { 1..1 } else { top..bottom + 1 };
            rows.flat_map(move |y| (left..right + 1).map(move |x| (y * tiles.x + x) as usize))
        };
        let mut starts = vec![0u32; (tiles.x * tiles.y) as usize + 1];
        boxes.iter().flat_map(touched).for_each(|tile| starts[tile + 1] += 1);
        (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
        let mut next = starts.clone();
        let mut sorted = vec![0u32; starts[starts.len() - 1] as usize];
        for (i, cover) in boxes.iter().enumerate() {
            for tile in touched(cover) {
                sorted[next[tile] as usize] = i as u32;
                next[tile] += 1;
            }
        }
        Drawn { vertices, triangles, boxes, starts, sorted, tiles, view: *view }
    }

    fn facet(&self, triangle: u32) -> Facet {
        Facet::new(self.triangles[triangle as usize].map(|i| self.vertices[i as usize]))
    }

    /// Whether a triangle's corners run counter-clockwise as the eye sees them.
    pub fn faces(&self, triangle: u32) -> bool {
        self.facet(triangle).volume < 0.0
    }

    /// The vertices of a triangle, and the share that each has of it where a ray from the eye meets it.
    pub fn shares(&self, triangle: u32, direction: Vec3) -> ([u32; 3], [f32; 3]) {
        let [c, a, b] = self.facet(triangle).sides.map(|side| direction.as_dvec3().dot(side));
        (self.triangles[triangle as usize], [a, b, c].map(|share| (share / (a + b + c)) as f32))
    }

    /// For rays from the eye: distance (m) to the first triangle, infinity for none, and which it is.
    pub fn hits(&self, directions: &[Vec3], mut found: impl FnMut(usize, f32, u32)) {
        // Rays sorted by the pixel they go through.
        let pixel = |direction: Vec3| {
            let clip = self.view.clip_from_eye * direction.extend(1.0);
            let at = Vec2::new(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w) * self.view.size.as_vec2();
            at.max(Vec2::ZERO).as_uvec2().min(self.view.size.saturating_sub(UVec2::ONE))
        };
        let places: Vec<UVec2> = directions.iter().map(|&d| pixel(d)).collect();
        let Some(low) = places.iter().copied().reduce(UVec2::min) else { return };
        let high = places.iter().copied().fold(low, UVec2::max);
        let width = high.x - low.x + 1;
        let bucket = |at: UVec2| ((at.y - low.y) * width + at.x - low.x) as usize;
        let mut starts = vec![0u32; (width * (high.y - low.y + 1)) as usize + 1];
        places.iter().for_each(|&at| starts[bucket(at) + 1] += 1);
        (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
        let mut next = starts.clone();
        let mut sorted = vec![0u32; places.len()];
        for (k, &at) in places.iter().enumerate() {
            let slot = &mut next[bucket(at)];
            sorted[*slot as usize] = k as u32;
            *slot += 1;
        }
        let directions: Vec<DVec3> = directions.iter().map(|d| d.as_dvec3()).collect();
        let mut best = vec![(f64::INFINITY, u32::MAX); directions.len()];
        for tile_y in low.y / TILE..=high.y / TILE {
            for tile_x in low.x / TILE..=high.x / TILE {
                let tile = (tile_y * self.tiles.x + tile_x) as usize;
                // Only this tile's pixels: a triangle is listed in every tile that it touches.
                let from = low.max(UVec2::new(tile_x, tile_y) * TILE);
                let to = high.min(UVec2::new(tile_x, tile_y) * TILE + (TILE - 1));
                for &triangle in &self.sorted[self.starts[tile] as usize..self.starts[tile + 1] as usize] {
                    let [left, right, top, bottom] = self.boxes[triangle as usize];
                    let (x0, x1) = (left.max(from.x), right.min(to.x));
                    let (y0, y1) = (top.max(from.y), bottom.min(to.y));
                    if x0 > x1 || y0 > y1 {
                        continue;
                    }
                    let facet = self.facet(triangle);
                    for y in y0..=y1 {
                        let row = bucket(UVec2::new(x0, y));
                        let span = starts[row] as usize..starts[row + (x1 - x0) as usize + 1] as usize;
                        for &k in &sorted[span] {
                            let k = k as usize;
                            if let Some(distance) = facet.hit(directions[k])
                                && (distance, triangle) < best[k]
                            {
                                best[k] = (distance, triangle);
                            }
                        }
                    }
                }
            }
        }
        for (k, (distance, triangle)) in best.into_iter().enumerate() {
            if triangle != u32::MAX {
                found(k, distance as f32, triangle);
            }
        }
    }

    /// Distances (m) along rays from the eye, infinity for none.
    pub fn first_hits(&self, rays: &[LocalRay], distances: &mut [f32]) {
        let directions: Vec<Vec3> = rays.iter().map(|ray| ray.direction).collect();
        distances.fill(f32::INFINITY);
        self.hits(&directions, |k, distance, _| distances[k] = distance);
    }

    /// Darkens a picture along the mesh's edges, where nothing else is seen before them.
    pub fn trace(&self, picture: &mut Picture) {
        /// Half the width of a line (pixels), and how dark it is.
        const HALF: f64 = 0.45;
        const DARK: f32 = 0.72;
        let (corner, right, down) = self.view.frame();
        let width = self.view.size.x as usize;
        let scale = f64::from(self.view.pixels_per_radian);
        let depths = &picture.depth;
        let lines = picture.radiance.par_chunks_mut(width).enumerate();
        lines.for_each(|(y, line)| {
            let directions: Vec<Vec3> = (0..width * 2)
                .map(|i| {
                    let (x, half) = (i / 2, (i & 1) as f32 * 0.5 + 0.25);
                    (corner + right * (x as f32 + half) + down * (y as f32 + 0.75 - 0.5 * half)).normalize()
                })
                .collect();
            self.hits(&directions, |k, distance, triangle| {
                let at = k / 2;
                if distance > depths[y * width + at] * 1.01 + 0.05 {
                    return;
                }
                let corners = self.triangles[triangle as usize].map(|i| self.vertices[i as usize]);
                let facet = Facet::new(corners);
                let direction = directions[k].as_dvec3();
                let (mut nearest, mut narrowest) = (f64::INFINITY, f64::INFINITY);
                for (i, side) in facet.sides.iter().enumerate() {
                    let length = side.length().max(1e-30);
                    nearest = nearest.min(direction.dot(*side).abs() / length);
                    let opposite = corners[(i + 2) % 3];
                    narrowest = narrowest.min(opposite.dot(*side).abs() / (length * opposite.length().max(1e-30)));
                }
                let line_share = (HALF + 0.5 - nearest * scale).clamp(0.0, 1.0);
                // Triangles of a few pixels would be all line.
                let shown = ((narrowest * scale - 1.0) / 5.0).clamp(0.12, 1.0);
                let keep = 1.0 - 0.5 * DARK * (line_share * shown) as f32;
                line[at] = line[at].map(|v| v * keep);
            });
        });
    }
}

/// How far above its place each pixel shows a mesh of `field` (pixels; negative for below): where the ray through the pixel's middle meets the mesh, the
/// surface is raised or lowered to it. NaN where no mesh is seen. Row by row from the top left.
pub fn mesh_errors(mesh: &Mesh, field: &dyn HeightField, view: &View) -> Vec<f32> {
    let datum = field.datum();
    let drawn = Drawn::new(mesh, &datum, view);
    let (corner, right, down) = view.frame();
    let width = view.size.x as usize;
    let mut errors = vec![f32::NAN; width * view.size.y as usize];
    errors.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, line)| {
        let direction = |x: usize| (corner + right * (x as f32 + 0.5) + down * (y as f32 + 0.5)).normalize();
        let directions: Vec<Vec3> = (0..width).map(direction).collect();
        let (mut columns, mut places, mut seen) = (Vec::new(), Vec::new(), Vec::new());
        drawn.hits(&directions, |x, distance, _| {
            let world = view.eye + directions[x].as_dvec3() * f64::from(distance);
            let (place, height) = datum.place(world);
            columns.push(x);
            places.push(place);
            seen.push((world, height));
        });
        let mut heights = vec![0.0; places.len()];
        field.heights(&places, &mut heights);
        for (i, &x) in columns.iter().enumerate() {
            let (world, height) = seen[i];
            let true_place = datum.world(places[i], f64::from(heights[i])).0;
            if let (Some(here), Some(there)) = (view.pixel(world), view.pixel(true_place)) {
                line[x] = here.distance(there) * (height - f64::from(heights[i])).signum() as f32;
            }
        }
    });
    errors
}

/// Pixels that a triangle may cover: first and last column, first and last row.
fn cover(view: &View, corners: [DVec3; 3], last: UVec2) -> [u32; 4] {
    const NONE: [u32; 4] = [1, 0, 1, 0];
    let clip = corners.map(|c| view.clip_from_eye * c.as_vec3().extend(1.0));
    let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
    let mut add = |p: glam::Vec4| {
        let at = Vec2::new(0.5 + 0.5 * p.x / p.w, 0.5 - 0.5 * p.y / p.w) * view.size.as_vec2();
        (low, high) = (low.min(at), high.max(at));
    };
    for i in 0..3 {
        let (a, b) = (clip[i], clip[(i + 1) % 3]);
        if a.w >= View::NEAR {
            add(a);
        }
        if (a.w >= View::NEAR) != (b.w >= View::NEAR) {
            add(a.lerp(b, (View::NEAR - a.w) / (b.w - a.w)));
        }
    }
    // One pixel of room for rounding; written so that what is not a number covers nothing.
    let (low, high) = (low - 1.0, high + 1.0);
    let size = view.size.as_vec2();
    if !(high.x >= 0.0 && high.y >= 0.0 && low.x < size.x && low.y < size.y) {
        return NONE;
    }
    let (low, high) = (low.max(Vec2::ZERO).as_uvec2(), high.as_uvec2().min(last));
    [low.x, high.x, low.y, high.y]
}

/// Casts rays from the eye at a mesh, all others at the exact ground.
struct MeshCaster<'a> {
    exact: RayCaster<'a>,
    drawn: Drawn,
}

impl Caster for MeshCaster<'_> {
    fn first_hits(&self, rays: &[LocalRay], distances: &mut [f32]) {
        if rays.iter().all(|ray| ray.origin == Vec3::ZERO) {
            self.drawn.first_hits(rays, distances);
        } else {
            self.exact.first_hits(rays, distances);
        }
    }

    fn any_hits(&self, rays: &[LocalRay], hits: &mut [bool]) {
        self.exact.any_hits(rays, hits);
    }

    fn is_exact(&self) -> bool {
        false
    }
}

impl Stage<'_> {
    /// The ground as it is drawn, on which meshes for [`Stage::render_meshes`] are chosen: the scene's, but where that is missing a skin that is
    /// shown as mist, or a side of the block.
    pub fn land(&self) -> &Land {
        &self.ground.land
    }

    /// The picture that the ground is seen as, if it is.
    pub fn drape(&self) -> Option<&Drape> {
        self.scene.drape.filter(|_| self.scene.style == Style::Image)
    }

    /// What `view` sees when meshes stand for the surfaces they are of. Shadows and mirrors stay those of the exact ground.
    pub fn render_meshes(
        &self,
        meshes: &Meshes,
        sea: Option<&Sea>,
        view: &View,
        settings: &Settings,
        progress: &(dyn Fn(f32) + Sync),
    ) -> Picture {
        let exact = self.land().caster(view.eye);
        let water = meshes
            .water
            .zip(sea)
            .filter(|_| self.shows_waves())
            .map(|(mesh, sea)| Drawn::new(mesh, &sea.datum(), view));
        let settings = Settings { passes: settings.passes || meshes.wireframe, ..*settings };
        let ground = meshes.ground.map(|mesh| Drawn::new(mesh, &self.land().datum(), view));
        let Some(drawn) = ground else {
            let mut picture = self.render_with(&exact, water.as_ref(), sea, view, &settings, progress);
            water.iter().filter(|_| meshes.wireframe).for_each(|drawn| drawn.trace(&mut picture));
            return picture;
        };
        let caster = MeshCaster { exact, drawn };
        let mut picture = self.render_with(&caster, water.as_ref(), sea, view, &settings, progress);
        if meshes.wireframe {
            [Some(&caster.drawn), water.as_ref()].into_iter().flatten().for_each(|drawn| drawn.trace(&mut picture));
        }
        picture
    }
}

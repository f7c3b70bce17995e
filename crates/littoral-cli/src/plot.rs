//! Plots, as SVG and as PNG: of profiles, and what other commands draw on a [`Canvas`].

use crate::talk::{Failure, tidy};
use ab_glyph::{Font, FontRef, PxScale, ScaleFont};
use glam::{DVec2, UVec2};
use littoral_data::write::{self, PngPixels};
use std::fmt::Write as _;
use std::path::Path;
use tiny_skia::{BlendMode, FillRule, Paint, PathBuilder, Pixmap, PremultipliedColorU8, Stroke, Transform};

/// Heights over distance.
pub struct Plot {
    /// What it says on top.
    pub title: String,
    /// Pixels.
    pub size: UVec2,
    /// Distance (m) and height (m; `None` where void).
    pub points: Vec<(f64, Option<f64>)>,
}

/// A file's ending, if it is one of those that are allowed.
pub fn ending<'a>(file: &Path, allowed: &[&'a str]) -> Result<&'a str, Failure> {
    let ending = file.extension().and_then(|e| e.to_str()).unwrap_or("").to_lowercase();
    allowed.iter().find(|&&a| a == ending).copied().ok_or_else(|| {
        let got = if ending.is_empty() { "none".to_owned() } else { format!(".{ending}") };
        let list: Vec<String> = allowed.iter().map(|a| format!(".{a}")).collect();
        let expected = format!("expected a name ending in {}, got {got}; change it", list.join(", "));
        Failure::Usage(format!("{}: {expected}", file.display()))
    })
}

/// Writes a drawing of `size` pixels as `svg` or `png`.
pub fn save(file: &Path, kind: &str, size: UVec2, draw: &dyn Fn(&mut dyn Canvas)) -> Result<(), Failure> {
    if kind == "svg" {
        let mut canvas = Svg::new(size);
        draw(&mut canvas);
        let svg = canvas.finish();
        return Ok(write::whole(file, |sink| sink.write_all(svg.as_bytes()))?);
    }
    let failed =
        |what: &str| Failure::Work(format!("{}: expected to draw a plot, got \"{what}\"; use .svg", file.display()));
    let mut canvas = Pixels::new(size).map_err(failed)?;
    draw(&mut canvas);
    let colours: Vec<[u8; 3]> = canvas.pixmap.pixels().iter().map(|p| [p.red(), p.green(), p.blue()]).collect();
    Ok(write::png(file, size.x, size.y, PngPixels::Rgb8(&colours), &[])?)
}

impl Plot {
    /// Writes the plot as `svg` or `png`.
    pub fn write(&self, file: &Path, kind: &str) -> Result<(), Failure> {
        save(file, kind, self.size, &|canvas| self.draw(canvas))
    }

    fn draw(&self, canvas: &mut dyn Canvas) {
        let (width, height) = (f64::from(self.size.x), f64::from(self.size.y));
        let size = (0.028 * height).clamp(9.0, 28.0);
        let (left, right) = (5.2 * size, width - 1.6 * size);
        let (top, bottom) = (2.6 * size, height - 3.4 * size);

        let length = self.points.last().map_or(1.0, |p| p.0).max(1e-9);
        let known = || self.points.iter().filter_map(|p| p.1);
        let (low, high) = (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max));
        let room = (0.06 * (high - low)).max(0.5);
        let (low, high) = (low - room, high + room);
        let x = |distance: f64| left + (right - left) * distance / length;
        let y = |h: f64| bottom - (bottom - top) * (h - low) / (high - low);
        let level = |from: f64, to: f64, at: f64| [DVec2::new(from, at), DVec2::new(to, at)];

        for tick in ticks(low, high, ((bottom - top) / (3.0 * size)).max(2.0)) {
            let at = y(tick);
            canvas.line(&level(left, right, at), LIGHT, 1.0);
            canvas.text(DVec2::new(left - 0.5 * size, at + 0.35 * size), Anchor::End, size, INK, &tidy(tick, 3));
        }
        let (unit, metres) = if length >= 5000.0 { ("km", 1000.0) } else { ("m", 1.0) };
        for tick in ticks(0.0, length / metres, ((right - left) / (6.0 * size)).max(2.0)) {
            let at = x(tick * metres);
            canvas.line(&[DVec2::new(at, bottom), DVec2::new(at, bottom + 0.4 * size)], GREY, 1.0);
            canvas.text(DVec2::new(at, bottom + 1.5 * size), Anchor::Middle, size, INK, &tidy(tick, 3));
        }
        // The ground: one area for each stretch without voids.
        for stretch in self.points.split(|p| p.1.is_none()).filter(|s| s.len() > 1) {
            let thin = thinned(stretch, (right - left).max(1.0) as usize * 2);
            let mut line: Vec<DVec2> = thin.iter().map(|&(distance, h)| DVec2::new(x(distance), y(h))).collect();
            let (Some(&first), Some(&last)) = (line.first(), line.last()) else { continue };
            canvas.line(&line, EARTH, 1.6);
            line.extend([DVec2::new(last.x, bottom), DVec2::new(first.x, bottom)]);
            canvas.area(&line, SAND);
        }
        if low < 0.0 && high > 0.0 {
            let at = y(0.0);
            canvas.line(&level(left, right, at), SEA, 1.2);
        }
        canvas.line(&[DVec2::new(left, top), DVec2::new(left, bottom), DVec2::new(right, bottom)], GREY, 1.0);
        let steepened = (bottom - top) / (high - low) / ((right - left) / length);
        let steepened = tidy(steepened, if steepened < 10.0 { 1 } else { 0 });
        canvas.text(DVec2::new(left + 2.0 * size, 1.7 * size), Anchor::Start, 1.15 * size, INK, &self.title);
        canvas.text(DVec2::new(0.8 * size, 1.7 * size), Anchor::Start, size, INK, "height (m)");
        let below = format!("distance ({unit}); heights drawn {steepened} times as steep");
        canvas.text(DVec2::new(right, bottom + 2.9 * size), Anchor::End, size, INK, &below);
    }
}

/// Red, green, blue.
pub type Colour = [u8; 3];
/// Text.
pub const INK: Colour = [0x33; 3];
/// Axes and lesser text.
pub const GREY: Colour = [0x88; 3];
/// Lines behind the data.
pub const LIGHT: Colour = [0xdd; 3];
/// Water.
pub const SEA: Colour = [0x2b, 0x6c, 0xa3];
const EARTH: Colour = [0x5d, 0x4a, 0x2f];
const SAND: Colour = [0xc9, 0xbf, 0xa5];

/// Which end of a text lies at its position.
#[derive(Clone, Copy, PartialEq)]
pub enum Anchor {
    /// Its left end.
    Start,
    /// Its middle.
    Middle,
    /// Its right end.
    End,
}

/// What a plot is drawn on. Positions in pixels from the top left corner; texts stand on theirs. Later things lie above
/// earlier ones, but an area lies below what is there.
pub trait Canvas {
    /// A polyline.
    fn line(&mut self, points: &[DVec2], colour: Colour, width: f64);
    /// A filled polygon below what is there.
    fn area(&mut self, points: &[DVec2], colour: Colour);
    /// A filled polygon above what is there.
    fn patch(&mut self, points: &[DVec2], colour: Colour);
    /// A line of text, its letters `size` pixels high.
    fn text(&mut self, at: DVec2, anchor: Anchor, size: f64, colour: Colour, text: &str);
}

struct Svg {
    size: UVec2,
    areas: String,
    rest: String,
}

impl Svg {
    fn new(size: UVec2) -> Svg {
        Svg { size, areas: String::new(), rest: String::new() }
    }

    fn finish(self) -> String {
        let UVec2 { x, y } = self.size;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{x}\" height=\"{y}\" viewBox=\"0 0 {x} {y}\" \
             font-family=\"Ubuntu, Helvetica, Arial, sans-serif\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
             {}{}</svg>\n",
            self.areas, self.rest
        )
    }

    fn path(points: &[DVec2]) -> String {
        let mut path = String::new();
        for point in points {
            // Writing to a string does not fail.
            let _ = write!(path, "{}{:.2} {:.2}", if path.is_empty() { 'M' } else { 'L' }, point.x, point.y);
        }
        path
    }
}

fn hex([r, g, b]: Colour) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

impl Canvas for Svg {
    fn line(&mut self, points: &[DVec2], colour: Colour, width: f64) {
        let (path, colour) = (Svg::path(points), hex(colour));
        let _ = writeln!(self.rest, "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\"/>");
    }

    fn area(&mut self, points: &[DVec2], colour: Colour) {
        let _ = writeln!(self.areas, "<path d=\"{}Z\" fill=\"{}\"/>", Svg::path(points), hex(colour));
    }

    fn patch(&mut self, points: &[DVec2], colour: Colour) {
        let _ = writeln!(self.rest, "<path d=\"{}Z\" fill=\"{}\"/>", Svg::path(points), hex(colour));
    }

    fn text(&mut self, at: DVec2, anchor: Anchor, size: f64, colour: Colour, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let (x, y, colour, text) = (at.x, at.y, hex(colour), escaped(text));
        let _ = writeln!(
            self.rest,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size:.1}\" text-anchor=\"{anchor}\" fill=\"{colour}\">{text}</text>"
        );
    }
}

struct Pixels {
    pixmap: Pixmap,
    font: FontRef<'static>,
}

impl Pixels {
    fn new(size: UVec2) -> Result<Pixels, &'static str> {
        let mut pixmap = Pixmap::new(size.x, size.y).ok_or("no such size")?;
        pixmap.fill(tiny_skia::Color::WHITE);
        let font = FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).map_err(|_| "no font")?;
        Ok(Pixels { pixmap, font })
    }

    fn path(points: &[DVec2]) -> Option<tiny_skia::Path> {
        let mut path = PathBuilder::new();
        for (i, point) in points.iter().enumerate() {
            let [x, y] = point.as_vec2().to_array();
            if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
        path.finish()
    }

    fn paint([r, g, b]: Colour) -> Paint<'static> {
        let mut paint = Paint { anti_alias: true, ..Paint::default() };
        paint.set_color_rgba8(r, g, b, 255);
        paint
    }
}

impl Canvas for Pixels {
    fn line(&mut self, points: &[DVec2], colour: Colour, width: f64) {
        if let Some(path) = Pixels::path(points) {
            let stroke = Stroke { width: width as f32, ..Stroke::default() };
            self.pixmap.stroke_path(&path, &Pixels::paint(colour), &stroke, Transform::identity(), None);
        }
    }

    fn area(&mut self, points: &[DVec2], colour: Colour) {
        if let Some(path) = Pixels::path(points) {
            // Multiplied, so that lines drawn before stay visible.
            let paint = Paint { blend_mode: BlendMode::Multiply, ..Pixels::paint(colour) };
            self.pixmap.fill_path(&path, &paint, FillRule::Winding, Transform::identity(), None);
        }
    }

    fn patch(&mut self, points: &[DVec2], colour: Colour) {
        if let Some(path) = Pixels::path(points) {
            self.pixmap.fill_path(&path, &Pixels::paint(colour), FillRule::Winding, Transform::identity(), None);
        }
    }

    fn text(&mut self, at: DVec2, anchor: Anchor, size: f64, colour: Colour, text: &str) {
        // An em of `size` pixels, as an SVG's font size.
        let scale =
            PxScale::from(size as f32 * self.font.height_unscaled() / self.font.units_per_em().unwrap_or(1000.0));
        let font = self.font.as_scaled(scale);
        let ids: Vec<_> = text.chars().map(|c| font.glyph_id(c)).collect();
        let mut places = vec![0.0];
        for (i, &id) in ids.iter().enumerate() {
            let kern = ids.get(i + 1).map_or(0.0, |&next| font.kern(id, next));
            places.push(places[i] + font.h_advance(id) + kern);
        }
        let shift = match anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => 0.5 * places[ids.len()],
            Anchor::End => places[ids.len()],
        };
        let (width, height) = (self.pixmap.width() as i32, self.pixmap.height() as i32);
        for (&id, &place) in ids.iter().zip(&places) {
            let position = ab_glyph::point(at.x as f32 - shift + place, at.y as f32);
            let Some(outline) = font.outline_glyph(id.with_scale_and_position(scale, position)) else { continue };
            let corner = outline.px_bounds().min;
            let pixels = self.pixmap.pixels_mut();
            outline.draw(|x, y, coverage| {
                let (x, y) = (corner.x as i32 + x as i32, corner.y as i32 + y as i32);
                if (0..width).contains(&x) && (0..height).contains(&y) {
                    let pixel = &mut pixels[(y * width + x) as usize];
                    let mix = |old: u8, new: u8| {
                        (f32::from(old) + (f32::from(new) - f32::from(old)) * coverage.min(1.0)) as u8
                    };
                    let [r, g, b] = colour;
                    let (r, g, b) = (mix(pixel.red(), r), mix(pixel.green(), g), mix(pixel.blue(), b));
                    *pixel = PremultipliedColorU8::from_rgba(r, g, b, 255).unwrap_or(*pixel);
                }
            });
        }
    }
}

/// About `count` round numbers between two.
pub fn ticks(low: f64, high: f64, count: f64) -> Vec<f64> {
    let rough = (high - low) / count;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|&s| s >= rough).unwrap_or(rough);
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    (first..=last).map(|i| i as f64 * step).collect()
}

/// At most about `most` points of a stretch, keeping the lowest and the highest of each group, so that no peak is lost.
fn thinned(stretch: &[(f64, Option<f64>)], most: usize) -> Vec<(f64, f64)> {
    let known = |group: &[(f64, Option<f64>)]| group.iter().filter_map(|p| Some((p.0, p.1?))).collect::<Vec<_>>();
    if stretch.len() <= most {
        return known(stretch);
    }
    let mut points = Vec::with_capacity(most + 2);
    for group in stretch.chunks(stretch.len().div_ceil(most / 2)) {
        let group = known(group);
        let low = group.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1));
        let high = group.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1));
        if let (Some(low), Some(high)) = (low, high) {
            points.extend(if low.0 <= high.0 { [low, high] } else { [high, low] });
        }
    }
    points
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks(-3.0, 47.0, 5.0), [0.0, 10.0, 20.0, 30.0, 40.0]);
        assert_eq!(ticks(0.0, 1.0, 4.0), [0.0, 0.5, 1.0]);
        assert_eq!(ticks(1166.0, 2543.0, 6.0), [1500.0, 2000.0, 2500.0]);
    }

    #[test]
    fn thinning_keeps_peaks() {
        let mut stretch: Vec<_> = (0..100_000).map(|i| (f64::from(i), Some((f64::from(i) * 0.01).sin()))).collect();
        stretch[54_321].1 = Some(99.0);
        let thin = thinned(&stretch, 1000);
        assert!(thin.len() <= 1002 && thin.contains(&(54_321.0, 99.0)));
    }

    #[test]
    fn voids_leave_gaps_and_titles_are_escaped() {
        let points = (0..30).map(|i| (f64::from(i), (!(10..=20).contains(&i)).then_some(f64::from(i)))).collect();
        let mut canvas = Svg::new(UVec2::new(640, 320));
        Plot { title: "a<b & c".into(), size: canvas.size, points }.draw(&mut canvas);
        assert_eq!(canvas.areas.lines().count(), 2, "two stretches");
        assert!(canvas.finish().contains("a&lt;b &amp; c"));
    }

    #[test]
    fn a_plot_in_pixels_has_ground_and_text() {
        let points = (0..200).map(|i| (f64::from(i), Some(50.0))).collect();
        let mut canvas = Pixels::new(UVec2::new(640, 320)).expect("a canvas");
        Plot { title: "ground".into(), size: UVec2::new(640, 320), points }.draw(&mut canvas);
        let count = |colour: Colour| {
            let same = |p: &&PremultipliedColorU8| [p.red(), p.green(), p.blue()] == colour;
            canvas.pixmap.pixels().iter().filter(same).count()
        };
        assert!(count(SAND) > 20_000, "half of the plot is ground");
        let dark = canvas.pixmap.pixels()[..640 * 24].iter().filter(|p| p.red() < 120).count();
        assert!(dark > 20, "the title is legible: {dark} dark pixels");
    }
}

//! Plots of profiles: drawn as SVG, and as PNG by way of it.

use crate::talk::{Failure, tidy};
use glam::UVec2;
use littoral_data::write::{self, PngPixels};
use resvg::{tiny_skia, usvg};
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

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

impl Plot {
    /// Writes the plot as `svg` or `png`.
    pub fn write(&self, file: &Path, kind: &str) -> Result<(), Failure> {
        let svg = self.svg();
        if kind == "svg" {
            return Ok(write::whole(file, |sink| sink.write_all(svg.as_bytes()))?);
        }
        let failed = |what: String| {
            Failure::Work(format!("{}: expected to draw a plot, got \"{what}\"; use .svg", file.display()))
        };
        let mut fonts = usvg::fontdb::Database::new();
        fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
        fonts.set_sans_serif_family("Ubuntu");
        let options = usvg::Options { fontdb: Arc::new(fonts), ..usvg::Options::default() };
        let tree = usvg::Tree::from_str(&svg, &options).map_err(|e| failed(e.to_string()))?;
        let mut pixels = tiny_skia::Pixmap::new(self.size.x, self.size.y).ok_or_else(|| failed("size".into()))?;
        resvg::render(&tree, tiny_skia::Transform::identity(), &mut pixels.as_mut());
        let colours: Vec<[u8; 3]> = pixels.pixels().iter().map(|p| [p.red(), p.green(), p.blue()]).collect();
        Ok(write::png(file, self.size.x, self.size.y, PngPixels::Rgb8(&colours), &[])?)
    }

    /// The plot as SVG.
    fn svg(&self) -> String {
        let (width, height) = (f64::from(self.size.x), f64::from(self.size.y));
        let text_size = (0.028 * height).clamp(9.0, 28.0);
        let (left, right) = (5.2 * text_size, width - 1.6 * text_size);
        let (top, bottom) = (2.6 * text_size, height - 3.4 * text_size);

        let length = self.points.last().map_or(1.0, |p| p.0).max(1e-9);
        let known = || self.points.iter().filter_map(|p| p.1);
        let (low, high) = (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max));
        let room = (0.06 * (high - low)).max(0.5);
        let (low, high) = (low - room, high + room);
        let x = |distance: f64| left + (right - left) * distance / length;
        let y = |h: f64| bottom - (bottom - top) * (h - low) / (high - low);

        let mut svg = String::new();
        // Writing to a string does not fail.
        let _ = writeln!(
            svg,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"Ubuntu, Helvetica, Arial, sans-serif\" font-size=\"{text_size}\" fill=\"#333\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>"
        );
        // Lines and their numbers.
        let (unit, metres) = if length >= 5000.0 { ("km", 1000.0) } else { ("m", 1.0) };
        let vertical = ticks(low, high, ((bottom - top) / (3.0 * text_size)).max(2.0));
        for tick in &vertical {
            let (at, text) = (y(*tick), tidy(*tick, 3));
            let _ = writeln!(
                svg,
                "<path d=\"M{left:.1} {at:.1}H{right:.1}\" stroke=\"#ddd\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{text}</text>",
                left - 0.5 * text_size,
                at + 0.35 * text_size
            );
        }
        for tick in ticks(0.0, length / metres, ((right - left) / (6.0 * text_size)).max(2.0)) {
            let (at, text) = (x(tick * metres), tidy(tick, 3));
            let _ = writeln!(
                svg,
                "<path d=\"M{at:.1} {bottom:.1}v{:.1}\" stroke=\"#888\"/><text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{text}</text>",
                0.4 * text_size,
                bottom + 1.5 * text_size
            );
        }
        // The ground: one area for each stretch without voids.
        for stretch in self.points.split(|p| p.1.is_none()).filter(|s| s.len() > 1) {
            let mut line = String::new();
            for (distance, h) in thinned(stretch, (right - left).max(1.0) as usize * 2) {
                let _ = write!(line, "{}{:.2} {:.2}", if line.is_empty() { 'M' } else { 'L' }, x(distance), y(h));
            }
            let (from, to) = (x(stretch[0].0), x(stretch[stretch.len() - 1].0));
            let _ = writeln!(svg, "<path d=\"{line}V{bottom:.1}H{from:.2}Z\" fill=\"#c9bfa5\"/>");
            let _ = writeln!(svg, "<path d=\"{line}\" fill=\"none\" stroke=\"#5d4a2f\" stroke-width=\"1.6\"/>");
            debug_assert!(to >= from);
        }
        if low < 0.0 && high > 0.0 {
            let at = y(0.0);
            let _ = writeln!(
                svg,
                "<path d=\"M{left:.1} {at:.1}H{right:.1}\" stroke=\"#2b6ca3\" stroke-width=\"1.2\" stroke-dasharray=\"6 4\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" fill=\"#2b6ca3\" text-anchor=\"end\">height 0</text>",
                right - 0.3 * text_size,
                at - 0.4 * text_size
            );
        }
        let _ = writeln!(svg, "<path d=\"M{left:.1} {top:.1}V{bottom:.1}H{right:.1}\" fill=\"none\" stroke=\"#888\"/>");
        let steepened = (bottom - top) / (high - low) / ((right - left) / length);
        let steepened = tidy(steepened, if steepened < 10.0 { 1 } else { 0 });
        let _ = writeln!(
            svg,
            "<text x=\"{left:.1}\" y=\"{:.1}\" font-size=\"{:.1}\">{}</text>",
            1.7 * text_size,
            1.15 * text_size,
            escaped(&self.title)
        );
        let _ = writeln!(
            svg,
            "<text x=\"{right:.1}\" y=\"{:.1}\" text-anchor=\"end\">distance ({unit}); heights drawn {steepened} times as steep</text>",
            bottom + 2.9 * text_size
        );
        let _ = writeln!(
            svg,
            "<text transform=\"translate({:.1} {:.1}) rotate(-90)\" text-anchor=\"middle\">height (m)</text>",
            1.3 * text_size,
            0.5 * (top + bottom)
        );
        svg.push_str("</svg>\n");
        svg
    }
}

/// About `count` round numbers between two.
fn ticks(low: f64, high: f64, count: f64) -> Vec<f64> {
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
        assert!(ticks(1166.0, 2543.0, 6.0).len() >= 4);
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
        let points = (0..30).map(|i| (f64::from(i), (i < 10 || i > 20).then_some(f64::from(i)))).collect();
        let svg = Plot { title: "a<b & c".into(), size: UVec2::new(640, 320), points }.svg();
        assert_eq!(svg.matches("fill=\"#c9bfa5\"").count(), 2, "two stretches");
        assert!(svg.contains("a&lt;b &amp; c"));
    }
}

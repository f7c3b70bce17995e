//! The comparison as a picture: one column for each flight; error against triangles, time a frame, memory.

use super::{Answer, Row};
use crate::plot::{self, Anchor, Canvas, Colour, GREY, INK, LIGHT};
use crate::talk::{Failure, tidy};
use glam::{DVec2, UVec2};
use std::path::Path;

const SIZE: UVec2 = UVec2::new(1680, 1180);
/// Colours that stay apart for those who see few (after M. Okabe and K. Ito, 2008).
const COLOURS: [Colour; 8] = [
    [0x77, 0x77, 0x77],
    [0x00, 0x72, 0xb2],
    [0x00, 0x9e, 0x73],
    [0xe6, 0x9f, 0x00],
    [0xd5, 0x5e, 0x00],
    [0xcc, 0x79, 0xa7],
    [0x56, 0xb4, 0xe9],
    [0x22, 0x22, 0x22],
];
const TEXT: f64 = 15.0;

/// A rectangle of the picture with logarithmic axes.
struct Panel {
    low: DVec2,
    high: DVec2,
    /// Decimal logarithms of the least and greatest number across and up.
    across: [f64; 2],
    up: [f64; 2],
}

impl Panel {
    fn x(&self, number: f64) -> f64 {
        let share = (number.max(1e-9).log10() - self.across[0]) / (self.across[1] - self.across[0]);
        self.low.x + share.clamp(0.0, 1.0) * (self.high.x - self.low.x)
    }

    fn y(&self, number: f64) -> f64 {
        let share = (number.max(1e-9).log10() - self.up[0]) / (self.up[1] - self.up[0]);
        self.high.y - share.clamp(0.0, 1.0) * (self.high.y - self.low.y)
    }

    /// Lines at the powers of ten, and what they are.
    fn frame(&self, canvas: &mut dyn Canvas, across: bool, labels: bool) {
        let powers = |[from, to]: [f64; 2]| (from.ceil() as i32)..=(to.floor() as i32);
        for power in powers(self.up) {
            let at = self.y(10f64.powi(power));
            canvas.line(&[DVec2::new(self.low.x, at), DVec2::new(self.high.x, at)], LIGHT, 1.0);
            if labels {
                canvas.text(DVec2::new(self.low.x - 7.0, at + 5.0), Anchor::End, TEXT, INK, &short(power));
            }
        }
        for power in powers(self.across).filter(|_| across) {
            let at = self.x(10f64.powi(power));
            canvas.line(&[DVec2::new(at, self.low.y), DVec2::new(at, self.high.y)], LIGHT, 1.0);
            let anchor = if at > self.high.x - 15.0 { Anchor::End } else { Anchor::Middle };
            canvas.text(DVec2::new(at, self.high.y + 20.0), anchor, TEXT, INK, &short(power));
        }
        let corner = DVec2::new(self.low.x, self.high.y);
        canvas.line(&[self.low, corner, self.high], GREY, 1.2);
    }
}

/// A power of ten.
fn short(power: i32) -> String {
    match power {
        6.. => format!("{} M", 10i64.pow(power as u32 - 6)),
        3..=5 => format!("{} k", 10i64.pow(power as u32 - 3)),
        0..=2 => format!("{}", 10i64.pow(power as u32)),
        _ => tidy(10f64.powi(power), -power as usize),
    }
}

/// Decimal logarithms, in halves, that hold numbers; a decade at least.
fn decades(numbers: impl Iterator<Item = f64>) -> [f64; 2] {
    let logs = numbers.filter(|n| *n > 0.0 && n.is_finite()).map(f64::log10);
    let (low, high) = logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), n| (a.min(n), b.max(n)));
    if low > high {
        return [0.0, 1.0];
    }
    let low = (2.0 * low).floor() / 2.0;
    [low, ((2.0 * high).ceil() / 2.0).max(low + 1.0)]
}

/// Room for the numbers over bars, and for the lowest bar.
fn with_room([low, high]: [f64; 2]) -> [f64; 2] {
    [low - 0.5, high + 0.5]
}

/// Writes the figure as `svg` or `png`.
pub fn write(answer: &Answer, file: &Path, kind: &str) -> Result<(), Failure> {
    plot::save(file, kind, SIZE, &|canvas| draw(answer, canvas))
}

fn draw(answer: &Answer, canvas: &mut dyn Canvas) {
    let mut flights: Vec<&str> = Vec::new();
    let mut methods: Vec<&str> = Vec::new();
    for row in &answer.flights {
        if !flights.contains(&row.flight) {
            flights.push(row.flight);
        }
        if !methods.contains(&row.method.as_str()) {
            methods.push(&row.method);
        }
    }
    let colour = |method: &str| COLOURS[methods.iter().position(|m| *m == method).unwrap_or(0) % COLOURS.len()];
    let size = SIZE.as_dvec2();
    let title = format!(
        "Level of detail: {} x {} pixels, at most {} triangles",
        answer.frame[0], answer.frame[1], answer.most_triangles
    );
    canvas.text(DVec2::new(28.0, 40.0), Anchor::Start, 22.0, INK, &title);
    let mut at = 28.0;
    for method in &methods {
        square(canvas, DVec2::new(at + 7.0, 66.0), 7.0, colour(method));
        canvas.text(DVec2::new(at + 21.0, 72.0), Anchor::Start, 17.0, INK, method);
        at += 46.0 + 9.0 * method.len() as f64;
    }
    let (left, gap, right) = (72.0, 34.0, 28.0);
    let width = (size.x - left - right - gap * (flights.len() as f64 - 1.0)) / flights.len().max(1) as f64;
    let all = || answer.flights.iter().chain(&answer.sweep);
    let errors = || all().flat_map(|r| [r.error_max_pixels, r.error_99_pixels]).map(f64::from);
    let axes = [
        (decades(all().map(|r| r.triangles as f64)), decades(errors())),
        ([0.0, 1.0], with_room(decades(answer.flights.iter().map(Row::frame_ms)))),
        ([0.0, 1.0], with_room(decades(answer.flights.iter().map(|r| r.memory_mb)))),
    ];
    let rows = [(150.0, 560.0), (680.0, 860.0), (950.0, 1130.0)];
    let tolerance = tidy(answer.tolerance_pixels, 3);
    let names = [
        "true error (pixels) against triangles: greatest (squares), and of 99 % of all pixels (thin)".to_owned(),
        format!("milliseconds a frame, with the mesh, at a tolerance of {tolerance}"),
        format!("megabytes of drawing and method, at a tolerance of {tolerance}"),
    ];
    for (number, ((top, bottom), (across, up))) in rows.into_iter().zip(axes).enumerate() {
        let over = if number == 0 { top - 40.0 } else { top - 22.0 };
        canvas.text(DVec2::new(28.0, over), Anchor::Start, 16.0, INK, &names[number]);
        for (column, flight) in flights.iter().enumerate() {
            let low = DVec2::new(left + (width + gap) * column as f64, top);
            let panel = Panel { low, high: DVec2::new(low.x + width, bottom), across, up };
            panel.frame(canvas, number == 0, column == 0);
            if number == 0 {
                canvas.text(DVec2::new(low.x, top - 12.0), Anchor::Start, 16.0, GREY, flight);
                for method in &methods {
                    curves(answer, flight, method, &panel, colour(method), canvas);
                }
                continue;
            }
            let here: Vec<&Row> = answer.flights.iter().filter(|r| r.flight == *flight).collect();
            let step = width / here.len().max(1) as f64;
            for (i, row) in here.iter().enumerate() {
                let value = if number == 1 { row.frame_ms() } else { row.memory_mb };
                let (middle, height) = (low.x + (i as f64 + 0.5) * step, panel.y(value));
                let (from, to) = (middle - 0.34 * step, middle + 0.34 * step);
                let corners = [(from, bottom), (to, bottom), (to, height), (from, height)];
                canvas.patch(&corners.map(|(x, y)| DVec2::new(x, y)), colour(&row.method));
                let digits = if value < 1.0 { 2 } else { usize::from(value < 10.0) };
                canvas.text(DVec2::new(middle, height - 5.0), Anchor::Middle, TEXT, INK, &tidy(value, digits));
            }
        }
    }
}

/// Errors of a method over its triangles, one mark for each tolerance.
fn curves(answer: &Answer, flight: &str, method: &str, panel: &Panel, colour: Colour, canvas: &mut dyn Canvas) {
    let mine = |r: &&Row| r.flight == flight && r.method == method;
    let mut points: Vec<&Row> = answer.flights.iter().chain(&answer.sweep).filter(mine).collect();
    points.sort_by_key(|row| row.triangles);
    let line = |error: fn(&Row) -> f32| -> Vec<DVec2> {
        let place = |r: &&Row| DVec2::new(panel.x(r.triangles as f64), panel.y(f64::from(error(r))));
        points.iter().map(place).collect()
    };
    let (most, usual) = (line(|r| r.error_max_pixels), line(|r| r.error_99_pixels));
    canvas.line(&usual, colour, 1.0);
    canvas.line(&most, colour, 2.4);
    most.iter().for_each(|&at| square(canvas, at, 4.5, colour));
}

fn square(canvas: &mut dyn Canvas, at: DVec2, half: f64, colour: Colour) {
    let corners = [(-half, -half), (half, -half), (half, half), (-half, half)];
    canvas.patch(&corners.map(|(x, y)| at + DVec2::new(x, y)), colour);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_hold_their_numbers() {
        assert_eq!(decades([20.0, 400.0].into_iter()), [1.0, 3.0]);
        assert_eq!(decades([0.0, f64::NAN, 5.0].into_iter()), [0.5, 1.5], "what is no number counts for nothing");
        assert_eq!(decades([].into_iter()), [0.0, 1.0]);
        assert_eq!([short(-1), short(2), short(4), short(6)], ["0.1", "100", "10 k", "1 M"]);
        let panel =
            Panel { low: DVec2::new(10.0, 20.0), high: DVec2::new(110.0, 220.0), across: [0.0, 2.0], up: [0.0, 1.0] };
        assert_eq!([panel.x(10.0), panel.y(1.0), panel.y(1e9)], [60.0, 220.0, 20.0]);
    }
}

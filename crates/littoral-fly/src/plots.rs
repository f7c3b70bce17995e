//! Plots of the last frames: a line each, from zero to a round number above the largest.

use crate::cockpit::{History, median};
use egui::{Align2, Color32, FontId, Sense, Stroke, Ui};
use std::collections::VecDeque;

/// All of them.
pub fn show(ui: &mut Ui, history: &History) {
    plot(ui, "frame", " ms", &history.frame, Color32::from_rgb(120, 200, 255));
    plot(ui, "method", " ms", &history.method, Color32::from_rgb(160, 230, 140));
    plot(ui, "triangles", "", &history.triangles, Color32::from_rgb(255, 200, 110));
    plot(ui, "uploads", " MB", &history.uploads, Color32::from_rgb(210, 170, 255));
    plot(ui, "bound", " px", &history.bound, Color32::from_rgb(255, 140, 140));
}

/// The least of 1, 2, 5, 10 … that is no less.
fn round_above(value: f32) -> f32 {
    if !(value > 0.0 && value.is_finite()) {
        return 1.0;
    }
    let power = 10f32.powf(value.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|top| *top >= value).unwrap_or(10.0 * power)
}

fn words(value: f32) -> String {
    match value {
        v if v >= 1e6 => format!("{:.2}M", v * 1e-6),
        v if v >= 1e4 => format!("{:.0}k", v * 1e-3),
        v if v >= 100.0 => format!("{v:.0}"),
        v if v >= 10.0 => format!("{v:.1}"),
        v => format!("{v:.2}"),
    }
}

fn plot(ui: &mut Ui, name: &str, unit: &str, values: &VecDeque<f32>, colour: Color32) {
    const HEIGHT: f32 = 34.0;
    let (rect, _) = ui.allocate_exact_size(egui::vec2(ui.available_width(), HEIGHT), Sense::hover());
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, Color32::from_black_alpha(90));
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    // One stall shall not flatten all the rest.
    let (most, usual) = (finite().fold(0.0, f32::max), median(finite()));
    let top = round_above(if usual > 0.0 { most.min(8.0 * usual) } else { most });
    let step = rect.width() / (values.len().max(2) - 1) as f32;
    let points: Vec<egui::Pos2> = values
        .iter()
        .enumerate()
        .filter(|(_, v)| v.is_finite())
        .map(|(i, v)| egui::pos2(rect.left() + i as f32 * step, rect.bottom() - HEIGHT * (v / top).min(1.0)))
        .collect();
    painter.line(points, Stroke::new(1.2, colour));
    let font = FontId::proportional(10.5);
    let now = median(values.iter().rev().take(12).copied());
    painter.text(rect.left_top() + egui::vec2(4.0, 2.0), Align2::LEFT_TOP, name, font.clone(), Color32::WHITE);
    let text = format!("{}{unit}  (to {})", words(now), words(top));
    painter.text(rect.right_top() + egui::vec2(-4.0, 2.0), Align2::RIGHT_TOP, text, font, Color32::LIGHT_GRAY);
}

#[cfg(test)]
mod tests {
    #[test]
    fn tops_are_round_and_above() {
        for (value, top) in [(0.0, 1.0), (f32::NAN, 1.0), (0.3, 0.5), (1.0, 1.0), (17.0, 20.0), (900.0, 1000.0)] {
            assert!((super::round_above(value) - top).abs() < 1e-3 * top, "{value}");
        }
    }
}

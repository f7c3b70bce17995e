//! The line below the picture: what is where, and how well it is drawn.

use crate::chooser::Limit;
use crate::cockpit::{Cockpit, median};
use crate::scene::Choice;
use egui::{Color32, RichText, Ui};

/// The line.
pub fn show(ui: &mut Ui, cockpit: &Cockpit) {
    let frame = egui::Frame::side_top_panel(ui.style()).fill(Color32::from_black_alpha(215));
    egui::Panel::bottom("status").frame(frame).show(ui, |ui| {
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 14.0;
            drawn(ui, cockpit);
            place(ui, cockpit);
        });
    });
}

/// How well it is drawn.
fn drawn(ui: &mut Ui, cockpit: &Cockpit) {
    let milliseconds = median(cockpit.history.frame.iter().rev().take(12).copied());
    let rate = if milliseconds > 0.0 { 1000.0 / milliseconds } else { 0.0 };
    ui.label(format!("{rate:.*} frames/s", usize::from(rate < 9.95)));
    let Some(first) = cockpit.frame.as_ref().map(|frame| &frame.first) else { return };
    ui.label(format!("{} in {:.1} ms", first.detail.method, first.milliseconds));
    ui.label(format!("{} triangles", thousands(first.triangles())));
    let parts = [("ground", Some(&first.ground), first.detail.unit()), ("sea", first.water.as_ref(), "px")];
    for (what, chosen, unit) in parts {
        let Some(chosen) = chosen else { continue };
        let bound = format!("{what} within {:.2} {unit}", chosen.reached.pixels);
        match chosen.limit {
            Some(_) => {
                ui.colored_label(Color32::ORANGE, bound).on_hover_text("not within the tolerance: the panel says why")
            }
            None => ui.label(bound),
        };
    }
}

/// What is where.
fn place(ui: &mut Ui, cockpit: &Cockpit) {
    let Some(subject) = &cockpit.subject else { return };
    ui.separator();
    let eye = cockpit.camera.eye;
    let stretch = subject.order.exaggeration;
    ui.label(subject.shown(eye.truncate()));
    ui.label(format!("height {:.1} m", eye.z / stretch));
    match (subject.ground(eye.truncate()), subject.still_water(eye.truncate())) {
        (_, Some(water)) => ui.label(format!("{:.1} m over water", (eye.z - water) / stretch)),
        (Some(ground), None) => ui.label(format!("{:.1} m over ground", (eye.z - ground) / stretch)),
        (None, None) => ui.label("no ground below"),
    };
    ui.label(RichText::new(&subject.datum).weak());
    if stretch != 1.0 {
        ui.colored_label(Color32::ORANGE, format!("heights × {stretch}"));
    }
    if cockpit.frozen.is_some() {
        ui.colored_label(Color32::ORANGE, "triangles frozen (F)");
    }
}

/// Why a method did not keep its tolerance, if it did not.
pub fn limit_words(choice: &Choice) -> Option<String> {
    let why = |limit, coarser| match limit {
        Limit::Triangles => "the most triangles, not the tolerance, end it",
        Limit::Finest if coarser => "finer cells are left out",
        Limit::Finest => "there are no finer cells",
        Limit::Windows => "the number of windows, not the tolerance, ends it",
        Limit::Time => "the time for a change ended it",
    };
    let ground = choice.ground.limit.map(|limit| why(limit, choice.detail.coarser > 0));
    let sea = choice.water.as_ref().and_then(|water| water.limit).map(|limit| why(limit, false));
    match (ground, sea) {
        (Some(ground), Some(sea)) if ground == sea => Some(format!("ground and sea: {ground}")),
        (Some(ground), Some(sea)) => Some(format!("ground: {ground}; sea: {sea}")),
        (Some(ground), None) => Some(format!("ground: {ground}")),
        (None, sea) => Some(format!("sea: {}", sea?)),
    }
}

/// A count, its thousands apart.
pub fn thousands(count: usize) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    #[test]
    fn counts_are_readable() {
        let cases = [(0, "0"), (999, "999"), (1000, "1 000"), (1_234_567, "1 234 567")];
        cases.iter().for_each(|(count, text)| assert_eq!(super::thousands(*count), *text));
    }
}

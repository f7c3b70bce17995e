//! The path that is made, and flown.

use crate::cockpit::Cockpit;
use crate::panel::{Ask, Shown, section};
use egui::{DragValue, TextEdit, Ui};
use littoral::flight::{Interpolation, Level, Pace};
use std::path::Path;

/// The path.
pub fn show(ui: &mut Ui, cockpit: &mut Cockpit, shown: &Shown, asks: &mut Vec<Ask>) {
    section(ui, "Path", cockpit.editing, |ui| {
        ui.checkbox(&mut cockpit.editing, "Clicks add points (L)");
        ui.horizontal(|ui| {
            ui.add(DragValue::new(&mut cockpit.editor.above).range(0.0..=100_000.0).suffix(" m"));
            ui.label("over the ground");
            ui.checkbox(&mut cockpit.editor.relative, "moves with it");
        });
        let mut path = cockpit.editor.path().clone();
        ui.horizontal(|ui| {
            for (each, name) in [
                (Interpolation::Straight, "Straight"),
                (Interpolation::CatmullRom, "Catmull–Rom"),
                (Interpolation::Smooth, "Smooth"),
            ] {
                ui.selectable_value(&mut path.interpolation, each, name);
            }
        });
        ui.horizontal(|ui| {
            match &mut path.pace {
                Pace::Speed(speed) => ui.add(DragValue::new(speed).range(0.1..=10_000.0).suffix(" m/s")),
                Pace::Duration(seconds) => ui.add(DragValue::new(seconds).range(0.1..=100_000.0).suffix(" s long")),
            };
            ui.checkbox(&mut path.closed, "closed");
        });
        cockpit.editor.replace(path);
        selected(ui, cockpit);
        let text = match (&cockpit.tape, cockpit.playing) {
            (Some(tape), Some(at)) => format!("{at:.1} of {:.1} s", tape.duration()),
            (Some(tape), None) => format!("{:.0} m, {:.0} s", tape.length, tape.duration()),
            (None, _) => format!("{} points", cockpit.editor.path().points.len()),
        };
        ui.horizontal(|ui| {
            if ui.button(if cockpit.playing.is_some() { "Stop (P)" } else { "Fly along (P)" }).clicked() {
                cockpit.play();
            }
            if ui.button(if shown.film.is_some() { "Stop film (R)" } else { "Film (R)" }).clicked() {
                asks.push(Ask::Film);
            }
            ui.label(text);
        });
        let (undo, redo) = cockpit.editor.can_undo();
        ui.horizontal(|ui| {
            if ui.add_enabled(undo, egui::Button::new("Undo")).clicked() {
                cockpit.editor.undo();
            }
            if ui.add_enabled(redo, egui::Button::new("Redo")).clicked() {
                cockpit.editor.redo();
            }
            if ui.button("Clear").clicked() {
                cockpit.editor.clear();
            }
            if ui.button("Once round").clicked() {
                cockpit.round_trip();
            }
        });
        ui.horizontal(|ui| {
            ui.add(TextEdit::singleline(&mut cockpit.path_file).desired_width(130.0));
            if ui.button("Save").clicked() {
                cockpit.save_path();
            }
            if ui.button("Load").clicked() {
                let file = cockpit.path_file.clone();
                cockpit.load_path(Path::new(file.trim()));
            }
        });
    });
}

/// The selected point of the path.
fn selected(ui: &mut Ui, cockpit: &mut Cockpit) {
    let Some(point) = cockpit.editor.selected.filter(|i| *i < cockpit.editor.path().points.len()) else { return };
    let level = cockpit.editor.path().points[point].spot.level;
    let subject = cockpit.subject.clone();
    let surface = |at| subject.as_ref()?.surface(at);
    ui.horizontal(|ui| {
        ui.label(format!("Point {}", point + 1));
        let (Level::AboveGround(height) | Level::Absolute(height)) = level;
        let mut now = height;
        let field = ui.add(DragValue::new(&mut now).suffix(" m"));
        cockpit.editor.raise(point, now - height);
        if field.drag_stopped() || field.lost_focus() {
            cockpit.editor.release();
        }
        let mut relative = matches!(level, Level::AboveGround(_));
        if ui.checkbox(&mut relative, "over ground").changed() {
            cockpit.editor.set_relative(point, relative, &surface);
        }
        if ui.small_button("Remove").clicked() {
            cockpit.editor.remove(point);
        }
    });
}

//! The panel: what can be changed, and the numbers.

use crate::camera::Mode;
use crate::cockpit::Cockpit;
use crate::keys;
use crate::plots;
use crate::settings::Split;
use egui::{Align2, Color32, RichText, Slider, Ui};
use glam::UVec2;

mod detail;
mod look;
mod overlay;
mod path;
mod sea;
mod status;

/// What the panel asks of the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ask {
    /// A picture of what is seen.
    Picture,
    /// A film along the path.
    Film,
    /// The view of the triangles held fast, or let go.
    Freeze,
}

/// What is shown beside the cockpit.
#[derive(Debug, Default)]
pub struct Shown {
    /// Whether the help is.
    pub help: bool,
    /// How far a film is, in frames made and to be made.
    pub film: Option<(usize, usize)>,
    /// The graphics adapter.
    pub adapter: String,
}

/// Everything over the picture.
pub fn show(ui: &mut Ui, cockpit: &mut Cockpit, shown: &mut Shown, size: UVec2, asks: &mut Vec<Ask>) {
    overlay::show(ui, cockpit, size);
    if cockpit.settings.split == Split::Halves {
        overlay::divider(ui, cockpit);
    }
    status::show(ui, cockpit);
    if cockpit.settings.panel {
        let frame = egui::Frame::side_top_panel(ui.style()).fill(Color32::from_black_alpha(215));
        egui::Panel::left("panel").default_size(270.0).frame(frame).show(ui, |ui| {
            egui::ScrollArea::vertical().show(ui, |ui| controls(ui, cockpit, shown, asks));
        });
    }
    let rest = ui.available_rect_before_wrap();
    notes(ui, cockpit, rest);
    if let Some((done, all)) = shown.film {
        let text = format!("filming: {done} of {all} frames; R stops");
        banner(ui, "film", rest.center_bottom() + egui::vec2(0.0, -60.0), &text, done as f32 / all.max(1) as f32);
    } else if let Some((what, done)) = &cockpit.working {
        banner(ui, "working", rest.center_bottom() + egui::vec2(0.0, -60.0), what, *done);
    }
    if shown.help {
        help(ui, shown);
    }
}

fn banner(ui: &Ui, id: &str, at: egui::Pos2, text: &str, done: f32) {
    egui::Area::new(egui::Id::unique(id)).fixed_pos(at).pivot(Align2::CENTER_BOTTOM).show(ui.ctx(), |ui| {
        egui::Frame::popup(ui.style()).show(ui, |ui| {
            ui.add(egui::ProgressBar::new(done).desired_width(320.0).text(text).animate(true));
        });
    });
}

fn notes(ui: &Ui, cockpit: &mut Cockpit, rest: egui::Rect) {
    let mut gone = None;
    let at = rest.right_top() + egui::vec2(-12.0, 12.0);
    egui::Area::new(egui::Id::unique("notes")).fixed_pos(at).pivot(Align2::RIGHT_TOP).show(ui.ctx(), |ui| {
        ui.set_max_width((0.5 * rest.width()).max(240.0));
        for (i, note) in cockpit.notes.iter().enumerate().rev().take(5) {
            egui::Frame::popup(ui.style()).show(ui, |ui| {
                ui.horizontal(|ui| {
                    if ui.small_button("×").clicked() {
                        gone = Some(i);
                    }
                    ui.add(egui::Label::new(&note.text).wrap());
                });
            });
        }
    });
    if let Some(i) = gone {
        cockpit.notes.remove(i);
    }
}

fn help(ui: &Ui, shown: &mut Shown) {
    egui::Window::new("Keys").open(&mut shown.help).resizable(false).anchor(Align2::CENTER_CENTER, [0.0, 0.0]).show(
        ui.ctx(),
        |ui| {
            egui::Grid::new("keys").num_columns(2).spacing([24.0, 5.0]).show(ui, |ui| {
                #[cfg(feature = "gamepad")]
                let pad = &crate::gamepad::HELP[..];
                #[cfg(not(feature = "gamepad"))]
                let pad = &[];
                for (keys, does) in keys::HELP.iter().chain(pad) {
                    ui.label(RichText::new(*keys).strong());
                    ui.label(*does);
                    ui.end_row();
                }
            });
            ui.separator();
            ui.label("Drop height files on the window to fly over them, a picture to lay it over the ground, a path's file to fly along it.");
        },
    );
}

fn controls(ui: &mut Ui, cockpit: &mut Cockpit, shown: &Shown, asks: &mut Vec<Ask>) {
    ui.heading(cockpit.subject.as_ref().map_or("Littoral", |subject| subject.name.as_str()));
    ui.horizontal(|ui| {
        ui.label(RichText::new("F1 keys · Tab panel · F12 picture").weak());
        if ui.small_button("Picture").clicked() {
            asks.push(Ask::Picture);
        }
    });
    ui.separator();
    detail::show(ui, cockpit, asks);
    moving(ui, cockpit);
    look::show(ui, cockpit);
    sea::show(ui, cockpit);
    path::show(ui, cockpit, shown, asks);
    egui::CollapsingHeader::new("Plots").default_open(true).show(ui, |ui| plots::show(ui, &cockpit.history));
    ui.label(RichText::new(&shown.adapter).weak().small());
}

fn section(ui: &mut Ui, title: &str, open: bool, content: impl FnOnce(&mut Ui)) {
    egui::CollapsingHeader::new(title).default_open(open).show(ui, content);
}

fn moving(ui: &mut Ui, cockpit: &mut Cockpit) {
    section(ui, "Moving", true, |ui| {
        let mut mode = cockpit.camera.mode();
        ui.horizontal(|ui| Mode::ALL.map(|each| ui.selectable_value(&mut mode, each, each.name())));
        if mode != cockpit.camera.mode() {
            cockpit.change_mode(mode);
        }
        let settings = &mut cockpit.settings;
        ui.add(Slider::new(&mut settings.speed, 0.05..=20.0).logarithmic(true).text("× speed"));
        ui.add(Slider::new(&mut settings.field_degrees, 10.0..=110.0).text("° of view"));
        ui.checkbox(&mut settings.below, "May go below the surface");
        if ui.button("Back to the first view (Home)").clicked() {
            cockpit.home();
        }
    });
}

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
    /// What panels leave of the window (points).
    pub free: Option<egui::Rect>,
}

impl Shown {
    /// Whether something of the panel's lies at a place (points). egui itself only knows of the place at which the mouse was a frame ago, which may have been a long one.
    pub fn covers(&self, context: &egui::Context, at: egui::Pos2) -> bool {
        let above = context.layer_id_at(at).is_some_and(|layer| layer.order != egui::Order::Background);
        above || self.free.is_some_and(|free| !free.contains(at))
    }
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
    shown.free = Some(rest);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{Settings, Style};
    use littoral::lod::Method;

    /// Runs the panel over nothing, in a window of some size (points).
    fn run(cockpit: &mut Cockpit, size: [f32; 2]) -> (egui::Context, Shown) {
        let (context, mut shown) = (egui::Context::default(), Shown::default());
        let screen = egui::Rect::from_min_size(egui::Pos2::ZERO, size.into());
        for _ in 0..2 {
            let input = egui::RawInput { screen_rect: Some(screen), ..Default::default() };
            let size = UVec2::new(size[0] as u32, size[1] as u32);
            let mut output = context.run_ui(input, |ui| show(ui, cockpit, &mut shown, size, &mut Vec::new()));
            output.textures_delta.clear(); // nobody paints them
        }
        (context, shown)
    }

    #[test]
    fn every_style_and_method_has_its_panel_in_windows_of_any_size() {
        for size in [[1280.0, 720.0], [200.0, 100.0], [1.0, 1.0]] {
            for style in Style::ALL {
                for method in Method::ALL {
                    let mut settings = Settings { style, split: Split::Halves, ..Settings::default() };
                    (settings.first.method, settings.second.method) = (method, method);
                    let before = settings.clone();
                    let mut cockpit = Cockpit::new(settings, Vec::new());
                    run(&mut cockpit, size);
                    assert_eq!(cockpit.settings, before, "nothing changes by being shown");
                }
            }
        }
    }

    #[test]
    fn the_panel_covers_what_it_covers() {
        let mut cockpit = Cockpit::new(Settings::default(), Vec::new());
        let covers = |cockpit: &mut Cockpit, x, y| {
            let (context, shown) = run(cockpit, [1280.0, 720.0]);
            shown.covers(&context, egui::pos2(x, y))
        };
        assert!(covers(&mut cockpit, 100.0, 300.0), "the panel");
        assert!(covers(&mut cockpit, 900.0, 715.0), "the status line");
        assert!(!covers(&mut cockpit, 900.0, 300.0), "the picture");
        cockpit.settings.split = Split::Halves;
        assert!(covers(&mut cockpit, 640.0, 360.0), "the handle between two pictures");
        cockpit.settings.panel = false;
        assert!(!covers(&mut cockpit, 100.0, 300.0), "the picture under a closed panel");
    }
}

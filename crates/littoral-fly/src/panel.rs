//! The panel: what can be changed, and the numbers.

use crate::calendar;
use crate::camera::Mode;
use crate::cockpit::{Cockpit, median};
use crate::compare::Difference;
use crate::keys;
use crate::plots;
use crate::scene::Choice;
use crate::seastate;
use crate::settings::{Detail, Settings, Show, Split, Style, SunBy};
use crate::steering::Steering;
use egui::{Align2, Color32, DragValue, RichText, Slider, TextEdit, Ui};
use glam::{DVec2, DVec3, UVec2, Vec2};
use littoral::flight::{Interpolation, Level, Pace};
use littoral::lod::Method;
use littoral::picture::Sun;
use std::path::Path;

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
    overlay(ui, cockpit, size);
    if cockpit.settings.split == Split::Halves {
        divider(ui, cockpit);
    }
    status(ui, cockpit);
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

/// The line between two pictures: its handle can be dragged.
fn divider(ui: &Ui, cockpit: &mut Cockpit) {
    let screen = ui.ctx().content_rect();
    let (style, show) = (cockpit.settings.style, cockpit.settings.show);
    let name = |choice: &Choice| choice.detail.name(style, show);
    let names = cockpit.frame.as_ref().map(|f| (name(&f.first), f.second.as_ref().map(name)));
    let middle = egui::pos2(screen.left() + cockpit.divider * screen.width(), screen.center().y);
    let area = egui::Area::new(egui::Id::unique("divider")).fixed_pos(middle).pivot(Align2::CENTER_CENTER);
    area.show(ui.ctx(), |ui| {
        let (rect, response) = ui.allocate_exact_size(egui::vec2(18.0, 56.0), egui::Sense::drag());
        let colour = if response.hovered() || response.dragged() { Color32::WHITE } else { Color32::from_gray(200) };
        ui.painter().rect_filled(rect, 6.0, Color32::from_black_alpha(160));
        let font = egui::FontId::proportional(16.0);
        for x in [-3.0, 0.0, 3.0] {
            let at = rect.center() + egui::vec2(x, 0.0);
            ui.painter().vline(at.x, at.y - 10.0..=at.y + 10.0, egui::Stroke::new(1.0, colour));
        }
        if let Some((first, Some(second))) = names {
            let painter = ui.ctx().layer_painter(egui::LayerId::background());
            for (name, at, align) in [(first, -14.0, Align2::RIGHT_TOP), (second, 14.0, Align2::LEFT_TOP)] {
                let at = egui::pos2(middle.x + at, screen.top() + 12.0);
                painter.text(at + egui::vec2(1.0, 1.0), align, name, font.clone(), Color32::BLACK);
                painter.text(at, align, name, font.clone(), Color32::WHITE);
            }
        }
        cockpit.divider = (cockpit.divider + response.drag_delta().x / screen.width().max(1.0)).clamp(0.02, 0.98);
        response.on_hover_cursor(egui::CursorIcon::ResizeHorizontal);
    });
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
            ui.label("Drop height files on the window to fly over them, a path's file to fly along it.");
        },
    );
}

/// What is where, and how well it is drawn.
fn status(ui: &mut Ui, cockpit: &Cockpit) {
    let frame = egui::Frame::side_top_panel(ui.style()).fill(Color32::from_black_alpha(215));
    egui::Panel::bottom("status").frame(frame).show(ui, |ui| {
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 14.0;
            let history = &cockpit.history;
            let milliseconds = median(history.frame.iter().rev().take(12).copied());
            ui.label(format!("{:.0} frames/s", if milliseconds > 0.0 { 1000.0 / milliseconds } else { 0.0 }));
            if let Some(frame) = &cockpit.frame {
                let first = &frame.first;
                ui.label(format!("{} in {:.1} ms", first.detail.method, first.milliseconds));
                ui.label(format!("{} triangles", thousands(first.triangles())));
                for (what, reached) in [("ground", Some(first.ground_reached)), ("sea", first.water_reached)] {
                    let Some(reached) = reached else { continue };
                    let bound = format!("{what} within {:.2} px", reached.pixels);
                    match reached.limited {
                        true => ui
                            .colored_label(Color32::ORANGE, bound)
                            .on_hover_text("the most triangles, not the tolerance, ended the refinement"),
                        false => ui.label(bound),
                    };
                }
            }
            if let Some(subject) = &cockpit.subject {
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
        });
    });
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

fn controls(ui: &mut Ui, cockpit: &mut Cockpit, shown: &Shown, asks: &mut Vec<Ask>) {
    ui.heading(cockpit.subject.as_ref().map_or("Littoral", |subject| subject.name.as_str()));
    ui.horizontal(|ui| {
        ui.label(RichText::new("F1 keys · Tab panel · F12 picture").weak());
        if ui.small_button("Picture").clicked() {
            asks.push(Ask::Picture);
        }
    });
    ui.separator();
    detail(ui, cockpit, asks);
    moving(ui, cockpit);
    look(ui, cockpit);
    sea(ui, cockpit);
    path(ui, cockpit, shown, asks);
    egui::CollapsingHeader::new("Plots").default_open(true).show(ui, |ui| plots::show(ui, &cockpit.history));
    ui.label(RichText::new(&shown.adapter).weak().small());
}

fn section(ui: &mut Ui, title: &str, open: bool, content: impl FnOnce(&mut Ui)) {
    egui::CollapsingHeader::new(title).default_open(open).show(ui, content);
}

fn detail(ui: &mut Ui, cockpit: &mut Cockpit, asks: &mut Vec<Ask>) {
    section(ui, "Detail", true, |ui| {
        let settings = &mut cockpit.settings;
        let steered = cockpit.steering.as_ref();
        ui.push_id("first", |ui| choice(ui, &mut settings.first, steered.map(Steering::tolerance)));
        ui.horizontal(|ui| {
            let mut limited = settings.budget_milliseconds > 0.0;
            if ui.checkbox(&mut limited, "time for a frame").changed() {
                settings.budget_milliseconds = if limited { 20.0 } else { 0.0 };
            }
            if limited {
                ui.add(DragValue::new(&mut settings.budget_milliseconds).range(1.0..=10_000.0).suffix(" ms"));
            }
        })
        .response
        .on_hover_text("The tolerance follows: frames become as fine as this time allows");
        if steered.is_some_and(|steering| steering.short) {
            ui.colored_label(Color32::ORANGE, "fewer triangles alone cannot keep it");
        }
        ui.horizontal(|ui| {
            for each in Split::ALL {
                ui.selectable_value(&mut settings.split, each, each.words().0).on_hover_text(each.words().1);
            }
        });
        if settings.split != Split::Off {
            if settings.split == Split::Difference {
                ui.add(Slider::new(&mut settings.gain, 1.0..=64.0).logarithmic(true).text("× amplified"));
            }
            ui.push_id("second", |ui| choice(ui, &mut settings.second, None));
            let (frame, difference) = (&cockpit.frame, cockpit.difference);
            compared(ui, settings, frame.as_ref().and_then(|f| Some((&f.first, f.second.as_ref()?))), difference);
        }
        ui.horizontal(|ui| {
            for each in Style::ALL {
                ui.selectable_value(&mut settings.style, each, each.words().0).on_hover_text(each.words().1);
            }
        });
        if settings.style == Style::Natural {
            let coarse = Slider::new(&mut settings.coarse, 1..=8).custom_formatter(|n, _| format!("1/{n:.0}"));
            ui.add(coarse.text("sharpness")).on_hover_text("One pixel of light for so many of the window's, each way");
        }
        ui.horizontal(|ui| Show::ALL.map(|each| ui.selectable_value(&mut settings.show, each, each.name())));
        let mut frozen = cockpit.frozen.is_some();
        if ui.checkbox(&mut frozen, "Freeze the triangles (F)").changed() {
            asks.push(Ask::Freeze);
        }
    });
}

/// A method, and how finely it draws. `steered` is the tolerance (pixels) that a budget of time has set.
fn choice(ui: &mut Ui, detail: &mut Detail, steered: Option<f64>) {
    egui::ComboBox::from_id_salt("method").selected_text(detail.method.name()).show_ui(ui, |ui| {
        for each in Method::ALL {
            ui.selectable_value(&mut detail.method, each, each.name()).on_hover_text(each.description());
        }
    });
    ui.label(RichText::new(detail.method.description()).weak().small());
    let mut tolerance = steered.unwrap_or(detail.tolerance_pixels);
    let slider = Slider::new(&mut tolerance, 0.1..=50.0).logarithmic(true).custom_formatter(|n, _| format!("{n:.2}"));
    if ui.add_enabled(steered.is_none(), slider.text("px tolerance")).changed() {
        detail.tolerance_pixels = tolerance;
    }
    ui.add(Slider::new(&mut detail.triangles, 1000..=5_000_000).logarithmic(true).text("most triangles"));
    ui.checkbox(&mut detail.rays, "exact ground, by rays")
        .on_hover_text("Natural pictures without edges show no triangles, but the ground as it is");
}

/// Two methods in figures.
fn compared(ui: &mut Ui, settings: &Settings, choices: Option<(&Choice, &Choice)>, difference: Option<Difference>) {
    let Some((first, second)) = choices else { return };
    egui::Grid::new("compared").num_columns(3).spacing([10.0, 2.0]).show(ui, |ui| {
        for each in [first, second] {
            ui.label(RichText::new(each.detail.name(settings.style, settings.show)).small());
            if !each.detail.shows_rays(settings.style, settings.show) {
                ui.label(RichText::new(format!("{} triangles", thousands(each.triangles()))).small());
                let words = format!("{:.2} px, {:.1} ms", each.ground_reached.pixels, each.milliseconds);
                ui.label(RichText::new(words).small());
            }
            ui.end_row();
        }
    });
    if let Some(Difference { mean, largest, off }) = difference {
        let words = format!(
            "{mean:.2} of 255 apart in the mean, {largest} at most; {:.2} % of pixels by more than 24",
            100.0 * off
        );
        ui.label(RichText::new(words).small());
    }
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

fn look(ui: &mut Ui, cockpit: &mut Cockpit) {
    section(ui, "Light and colours", false, |ui| {
        sun(ui, cockpit);
        let settings = &mut cockpit.settings;
        let visibility = Slider::new(&mut settings.visibility_kilometres, 0.0..=300.0).step_by(1.0);
        let words = |n: f64, _| if n == 0.0 { "as suits".to_owned() } else { format!("{n:.0} km") };
        ui.add(visibility.custom_formatter(words).text("visibility"));
        ui.horizontal(|ui| {
            let mut factor = cockpit.settings.exaggeration;
            let field = ui.add(DragValue::new(&mut factor).range(0.1..=100.0).speed(0.02).prefix("heights × "));
            cockpit.settings.exaggeration = factor;
            // The land is built anew, so not for each step of a drag.
            let settled = !field.dragged() && !field.has_focus();
            if settled && factor != cockpit.order.exaggeration {
                cockpit.order.exaggeration = factor;
            }
            if factor != 1.0 && ui.small_button("1").on_hover_text("as they are").clicked() {
                cockpit.settings.exaggeration = 1.0;
            }
        });
    });
}

fn sun(ui: &mut Ui, cockpit: &mut Cockpit) {
    ui.horizontal(|ui| {
        ui.label("Sun");
        for each in SunBy::ALL {
            let before = cockpit.sun().map(|sun| DVec2::new(sun.azimuth, sun.elevation).map(f64::to_degrees));
            let before = before.or(cockpit.own_sun());
            let (name, does) = each.words();
            let chosen = ui.selectable_value(&mut cockpit.settings.sun, each, name).on_hover_text(does);
            // A hand takes the sun from where it stands.
            if let (true, SunBy::Hand, Some(sun)) = (chosen.changed(), each, before) {
                let settings = &mut cockpit.settings;
                (settings.sun_azimuth_degrees, settings.sun_elevation_degrees) =
                    (sun.x.rem_euclid(360.0).round(), sun.y.clamp(-10.0, 90.0).round());
            }
        }
    });
    let known = cockpit.subject.as_ref().and_then(|subject| subject.lonlat());
    let now = cockpit.sun();
    let settings = &mut cockpit.settings;
    match settings.sun {
        SunBy::Land => {}
        SunBy::Hand => {
            ui.add(Slider::new(&mut settings.sun_azimuth_degrees, 0.0..=360.0).step_by(1.0).text("° sun's bearing"));
            ui.add(Slider::new(&mut settings.sun_elevation_degrees, -10.0..=90.0).step_by(0.5).text("° sun's height"));
        }
        SunBy::Date => {
            let year = settings.year;
            let day = Slider::new(&mut settings.day, 1..=calendar::day(year, u16::MAX).day_of_year().unsigned_abs());
            ui.add(day.custom_formatter(move |n, _| calendar::day_words(year, n as u16)).text("day"));
            let clock = |hour: f64, _| format!("{:.0}:{:02.0}", hour.floor(), (hour.fract() * 60.0).floor());
            let hour = Slider::new(&mut settings.hour, 0.0..=24.0).step_by(1.0 / 12.0).custom_formatter(clock);
            ui.add(hour.text("hour")).on_hover_text("By the sun of that place: at 12 it stands about highest");
            ui.horizontal(|ui| {
                ui.add(DragValue::new(&mut settings.year).range(calendar::YEARS).prefix("year "));
                if known.is_none() {
                    let degrees = |value, most: f64, name| {
                        DragValue::new(value).range(-most..=most).speed(0.1).max_decimals(2).prefix(name).suffix("°")
                    };
                    ui.add(degrees(&mut settings.latitude_degrees, 90.0, "north "));
                    ui.add(degrees(&mut settings.longitude_degrees, 180.0, "east "));
                }
            });
            ui.label(RichText::new(sun_words(settings, calendar::place(settings, known), now)).weak().small());
        }
    }
}

/// Which instant the sun by date is of, and where it stands.
fn sun_words(settings: &Settings, place: DVec2, sun: Option<Sun>) -> String {
    let stands = sun.map_or(String::new(), |sun| {
        let [bearing, height] = [sun.azimuth, sun.elevation].map(f64::to_degrees);
        format!(": bearing {bearing:.0}°, {height:.1}° high")
    });
    format!("{} at {:.2}° N, {:.2}° E{stands}", calendar::utc_words(settings, place), place.y, place.x)
}

fn sea(ui: &mut Ui, cockpit: &mut Cockpit) {
    section(ui, "Sea", true, |ui| {
        ui.checkbox(&mut cockpit.settings.waves, "Waves");
        ui.add_enabled_ui(cockpit.settings.waves, |ui| {
            let field = ui.add(TextEdit::singleline(&mut cockpit.sea_text).desired_width(f32::INFINITY)).on_hover_text(
                "beaufort=0…12 or wind=M/S, from=DEGREES; or hs=M,tp=S; more with fetch=KM, swell=HEIGHT@PERIOD/FROM",
            );
            if field.lost_focus() {
                cockpit.settings.sea = cockpit.sea_text.trim().to_owned();
            }
            wind(ui, cockpit);
            ui.horizontal_wrapped(|ui| {
                for (name, text) in [
                    ("Breeze", "beaufort=4,from=225"),
                    ("Gale", "beaufort=8,from=240"),
                    ("Swell", "wind=3,from=200,swell=2.5@13/240"),
                ] {
                    if ui.small_button(name).on_hover_text(text).clicked() {
                        cockpit.sea_text = text.to_owned();
                        cockpit.settings.sea = text.to_owned();
                    }
                }
                ui.checkbox(&mut cockpit.still, "stand still");
            });
            ui.label(RichText::new(format!("at {:.1} s", cockpit.time)).weak());
            if !cockpit.still && cockpit.settings.style == Style::Natural {
                let words = "Pictures get clean at rest while the sea stands still (Space).";
                ui.label(RichText::new(words).weak().small());
            }
        });
    });
}

/// The wind of the sea's state, as far as its words have one; the sea is made anew when a slider is let go.
fn wind(ui: &mut Ui, cockpit: &mut Cockpit) {
    let speeds = [("wind", "m/s wind", 0.5, 35.0, 0.5), ("beaufort", "Beaufort", 0.0, 12.0, 1.0)];
    let directions = [("from", "° it blows from", 0.0, 360.0, 5.0)];
    for (key, name, low, high, step) in speeds.into_iter().chain(directions) {
        let Some(mut value) = seastate::number(&cockpit.sea_text, key) else { continue };
        let slider = ui.add(Slider::new(&mut value, low..=high).step_by(step).text(name));
        if slider.changed() {
            cockpit.sea_text = seastate::with(&cockpit.sea_text, key, value);
        }
        if slider.drag_stopped() || slider.lost_focus() || (slider.changed() && !slider.dragged()) {
            cockpit.settings.sea = cockpit.sea_text.clone();
        }
    }
}

fn path(ui: &mut Ui, cockpit: &mut Cockpit, shown: &Shown, asks: &mut Vec<Ask>) {
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

/// The path, and what a frozen view sees, drawn over the picture.
fn overlay(ui: &Ui, cockpit: &Cockpit, size: UVec2) {
    let painter = ui.ctx().layer_painter(egui::LayerId::background());
    let scale = ui.ctx().pixels_per_point();
    let view = cockpit.view(size);
    let at = |world: DVec3| view.pixel(world).map(|p: Vec2| egui::pos2(p.x / scale, p.y / scale));
    let near = |p: &egui::Pos2| p.x.abs() < 1e5 && p.y.abs() < 1e5;
    if let Some(frozen) = &cockpit.frozen {
        let (corner, right, down) = frozen.frame();
        let pixels = frozen.size.as_vec2();
        let far = cockpit.subject.as_ref().map_or(1e4, |subject| 0.7 * subject.land.extent().length());
        let corners = [(0.0, 0.0), (pixels.x, 0.0), (pixels.x, pixels.y), (0.0, pixels.y)].map(|(x, y)| {
            let direction = (corner + right * x + down * y).normalize().as_dvec3();
            frozen.eye + direction * far
        });
        let stroke = egui::Stroke::new(1.5, Color32::from_rgb(255, 170, 60));
        for i in 0..4 {
            for ends in [[frozen.eye, corners[i]], [corners[i], corners[(i + 1) % 4]]] {
                // A line that passes the eye is drawn as far as it lies ahead.
                let places: Vec<_> = (0..=64).map(|k| at(ends[0].lerp(ends[1], f64::from(k) / 64.0))).collect();
                for pair in places.windows(2) {
                    if let [Some(a), Some(b)] = pair
                        && near(a)
                        && near(b)
                    {
                        painter.line_segment([*a, *b], stroke);
                    }
                }
            }
        }
    }
    // Whoever flies along a path does not want to see it.
    if cockpit.playing.is_some() {
        return;
    }
    if let Some(tape) = &cockpit.tape {
        let places: Vec<_> = tape.places(600).map(at).collect();
        for pair in places.windows(2) {
            if let [Some(a), Some(b)] = pair
                && near(a)
                && near(b)
            {
                painter.line_segment([*a, *b], egui::Stroke::new(4.0, Color32::from_black_alpha(110)));
                painter.line_segment([*a, *b], egui::Stroke::new(2.0, Color32::from_rgb(255, 214, 90)));
            }
        }
    }
    let surface = |xy| cockpit.surface(xy);
    for i in 0..cockpit.editor.path().points.len() {
        let Some(world) = cockpit.editor.position(i, &surface) else { continue };
        let Some(top) = at(world).filter(near) else { continue };
        let ground = surface(world.truncate()).map(|z| world.truncate().extend(z));
        if let Some(foot) = ground.and_then(at).filter(near) {
            painter.line_segment([top, foot], egui::Stroke::new(1.0, Color32::from_white_alpha(150)));
            painter.circle_filled(foot, 2.0, Color32::from_white_alpha(150));
        }
        let chosen = cockpit.editor.selected == Some(i);
        let colour = if chosen { Color32::from_rgb(255, 120, 60) } else { Color32::from_rgb(255, 214, 90) };
        painter.circle_filled(top, if chosen { 7.0 } else { 5.5 }, Color32::from_black_alpha(180));
        painter.circle_filled(top, if chosen { 5.5 } else { 4.0 }, colour);
        let font = egui::FontId::proportional(12.0);
        painter.text(top + egui::vec2(8.0, -8.0), Align2::LEFT_BOTTOM, format!("{}", i + 1), font, Color32::WHITE);
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn counts_are_readable() {
        let cases = [(0, "0"), (999, "999"), (1000, "1 000"), (1_234_567, "1 234 567")];
        cases.iter().for_each(|(count, text)| assert_eq!(super::thousands(*count), *text));
    }
}

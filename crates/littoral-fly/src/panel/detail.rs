//! The methods of detail and their settings.

use super::status::{limit_words, thousands};
use super::{Ask, section};
use crate::cockpit::Cockpit;
use crate::compare::Difference;
use crate::detail::{Detail, Roam};
use crate::scene::Choice;
use crate::settings::{Settings, Show, Split, Style};
use crate::steering::Steering;
use egui::{Color32, DragValue, RichText, Slider, Ui};
use littoral::field::Land;
use littoral::lod::Method;

/// How triangles are chosen, and what is seen of them.
pub fn show(ui: &mut Ui, cockpit: &mut Cockpit, asks: &mut Vec<Ask>) {
    section(ui, "Detail", true, |ui| {
        let land = cockpit.subject.as_ref().map(|subject| &subject.land);
        let settings = &mut cockpit.settings;
        let steered = cockpit.steering.as_ref();
        ui.push_id("first", |ui| choice(ui, &mut settings.first, land, steered.map(Steering::tolerance)));
        let frame = cockpit.frame.as_ref();
        if let Some(words) = frame.and_then(|frame| limit_words(&frame.first)) {
            ui.label(RichText::new(words).color(Color32::ORANGE).small());
        }
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
            ui.push_id("second", |ui| choice(ui, &mut settings.second, land, None));
            compared(ui, settings, frame.and_then(|f| Some((&f.first, f.second.as_ref()?))), cockpit.difference);
        }
        ui.horizontal(|ui| Show::ALL.map(|each| ui.selectable_value(&mut settings.show, each, each.name())));
        if settings.style != Style::Plain {
            let coarse = Slider::new(&mut settings.coarse, 1..=8).custom_formatter(|n, _| format!("1/{n:.0}"));
            ui.add(coarse.text("sharpness")).on_hover_text("One pixel of light for so many of the window's, each way");
        }
        let mut frozen = cockpit.frozen.is_some();
        if ui.checkbox(&mut frozen, "Freeze the triangles (F)").changed() {
            asks.push(Ask::Freeze);
        }
    });
}

/// A method, and how finely it draws. `steered` is the tolerance (pixels) that a budget of time has set.
fn choice(ui: &mut Ui, detail: &mut Detail, land: Option<&Land>, steered: Option<f64>) {
    egui::ComboBox::from_id_salt("method").selected_text(detail.method.name()).show_ui(ui, |ui| {
        for each in Method::ALL {
            ui.selectable_value(&mut detail.method, each, each.name()).on_hover_text(each.description());
        }
    });
    ui.label(RichText::new(detail.method.description()).weak().small());
    let mut tolerance = steered.unwrap_or(detail.tolerance_pixels);
    let slider = Slider::new(&mut tolerance, 0.1..=50.0).logarithmic(true).custom_formatter(|n, _| format!("{n:.2}"));
    let by_nearness = detail.method == Method::Roam && detail.roam.nearest_first;
    if ui.add_enabled(steered.is_none() && !by_nearness, slider.text("px tolerance")).changed() {
        detail.tolerance_pixels = tolerance;
    }
    ui.add(Slider::new(&mut detail.triangles, 1000..=5_000_000).logarithmic(true).text("most triangles"));
    if let Some(land) = land {
        // Cells of the finest level are the patches between samples.
        let spacing = land.raster().spacing().max_element();
        let words = |level: f64, _| metres(spacing * level.exp2());
        let levels = Slider::new(&mut detail.coarser, 0..=land.finest_level().min(10)).custom_formatter(words);
        ui.add(levels.text("finest cells")).on_hover_text("Samples are so far apart where nothing is left out");
    }
    own(ui, detail);
    ui.checkbox(&mut detail.rays, "exact ground, by rays")
        .on_hover_text("Lit pictures without edges show no triangles, but the ground as it is");
}

/// What the method alone has.
fn own(ui: &mut Ui, detail: &mut Detail) {
    match detail.method {
        Method::Nested => {
            ui.horizontal(|ui| {
                ui.label("seams");
                ui.selectable_value(&mut detail.morphing_seams, false, "strips")
                    .on_hover_text("Upright triangles over the coarser window's edges");
                ui.selectable_value(&mut detail.morphing_seams, true, "morphing")
                    .on_hover_text("Vertices move before they are left out");
            });
            ui.horizontal(|ui| {
                let mut counted = detail.windows > 0;
                if ui.checkbox(&mut counted, "number of windows").changed() {
                    detail.windows = if counted { 6 } else { 0 };
                }
                if counted {
                    ui.add(DragValue::new(&mut detail.windows).range(1..=16).speed(0.05));
                }
            })
            .response
            .on_hover_text("Whatever the tolerance and the number of triangles, as in 2009");
            ui.add(
                Slider::new(&mut detail.window_cells, 8..=512).step_by(4.0).logarithmic(true).text("cells a window"),
            )
            .on_hover_text("Along its side, at least");
        }
        Method::Quadtree => {
            ui.checkbox(&mut detail.morphs, "vertices move before they vanish");
        }
        Method::Roam => roam(ui, &mut detail.roam),
        Method::Whole | Method::Patches | Method::Strips => {}
    }
}

fn roam(ui: &mut Ui, roam: &mut Roam) {
    ui.horizontal(|ui| {
        ui.label("first");
        ui.selectable_value(&mut roam.nearest_first, false, "the worst")
            .on_hover_text("What is drawn farthest from its place, in pixels");
        ui.selectable_value(&mut roam.nearest_first, true, "the nearest")
            .on_hover_text("By inverse distance, whatever its shape, as on the sea of 1999: the most triangles end it");
    });
    ui.horizontal(|ui| {
        let mut limited = roam.milliseconds > 0.0;
        if ui.checkbox(&mut limited, "time for a change").changed() {
            roam.milliseconds = if limited { 0.5 } else { 0.0 };
        }
        if limited {
            ui.add(DragValue::new(&mut roam.milliseconds).range(0.05..=1000.0).speed(0.01).suffix(" ms"));
        }
    })
    .response
    .on_hover_text("The most urgent comes first; what is left comes with the next frames");
    ui.checkbox(&mut roam.fog, "less in the haze").on_hover_text("As things fade by the visibility");
    let factor = |value, range, text| Slider::new(value, range).max_decimals(2).text(text);
    ui.add(factor(&mut roam.back_faces, 0.0..=1.0, "× back faces"));
    ui.add(factor(&mut roam.silhouettes, 1.0..=8.0, "× silhouettes"));
    ui.add(factor(&mut roam.lighting, 0.0..=4.0, "+ uneven light"))
        .on_hover_text("One more for each unit that slopes differ by");
}

/// A length for people.
fn metres(length: f64) -> String {
    match length {
        l if l >= 10_000.0 => format!("{:.0} km", l * 1e-3),
        l if l >= 1000.0 => format!("{:.1} km", l * 1e-3),
        l if l >= 10.0 => format!("{l:.0} m"),
        l => format!("{l:.1} m"),
    }
}

/// Two methods in figures.
fn compared(ui: &mut Ui, settings: &Settings, choices: Option<(&Choice, &Choice)>, difference: Option<Difference>) {
    let Some((first, second)) = choices else { return };
    egui::Grid::new("compared").num_columns(3).spacing([10.0, 2.0]).show(ui, |ui| {
        for each in [first, second] {
            ui.label(RichText::new(each.detail.name(settings.style, settings.show)).small());
            if !each.detail.shows_rays(settings.style, settings.show) {
                ui.label(RichText::new(format!("{} triangles", thousands(each.triangles()))).small());
                let bound = each.ground.reached.pixels;
                let words = format!("{bound:.2} {}, {:.1} ms", each.detail.unit(), each.milliseconds);
                ui.label(RichText::new(words).small());
            }
            ui.end_row();
        }
    });
    if let Some(words) = limit_words(second) {
        ui.label(RichText::new(format!("{}: {words}", second.detail.method)).color(Color32::ORANGE).small());
    }
    if let Some(Difference { mean, largest, off }) = difference {
        let words = format!(
            "{mean:.2} of 255 apart in the mean, {largest} at most; {:.2} % of pixels by more than 24",
            100.0 * off
        );
        ui.label(RichText::new(words).small());
    }
}

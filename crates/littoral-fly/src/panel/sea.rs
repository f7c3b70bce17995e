//! The sea.

use super::section;
use crate::cockpit::Cockpit;
use crate::seastate::{self, Surf};
use crate::settings::Style;
use egui::{RichText, Slider, TextEdit, Ui};

/// Waves, their wind, and the surf that they make.
pub fn show(ui: &mut Ui, cockpit: &mut Cockpit) {
    section(ui, "Sea", true, |ui| {
        ui.checkbox(&mut cockpit.settings.waves, "Waves");
        ui.add_enabled_ui(cockpit.settings.waves, |ui| {
            let field = ui.add(TextEdit::singleline(&mut cockpit.sea_text).desired_width(f32::INFINITY)).on_hover_text(
                "beaufort=0…12 or wind=M/S, from=DEGREES; or hs=M,tp=S; more with fetch=KM, swell=HEIGHT@PERIOD/FROM, breaking=",
            );
            if field.lost_focus() {
                cockpit.settings.sea = cockpit.sea_text.trim().to_owned();
            }
            numbers(ui, cockpit);
            surf(ui, cockpit.surf);
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
            if !cockpit.still && cockpit.settings.style != Style::Plain {
                let words = "Pictures get clean at rest while the sea stands still (Space).";
                ui.label(RichText::new(words).weak().small());
            }
        });
    });
}

/// Numbers of the sea's state, as far as its words have them; the sea is made anew when a slider is let go.
fn numbers(ui: &mut Ui, cockpit: &mut Cockpit) {
    let sliders = [
        ("wind", "m/s wind", 0.5, 35.0, 0.5, None),
        ("beaufort", "Beaufort", 0.0, 12.0, 1.0, None),
        ("hs", "m high", 0.1, 12.0, 0.1, None),
        ("tp", "s from crest to crest", 2.0, 20.0, 0.5, None),
        ("from", "° it comes from", 0.0, 360.0, 5.0, None),
        ("breaking", "× depth: they break", 0.2, 1.5, 0.01, Some(0.78)),
    ];
    for (key, name, low, high, step, usual) in sliders {
        let Some(mut value) = seastate::number(&cockpit.sea_text, key).or(usual) else { continue };
        let mut slider = ui.add(Slider::new(&mut value, low..=high).step_by(step).text(name));
        if usual.is_some() {
            let words = "Height over depth at which waves break, 0.78 as a rule: with less they break farther out, and the surf is wider";
            slider = slider.on_hover_text(words);
        }
        if slider.changed() {
            cockpit.sea_text = seastate::with(&cockpit.sea_text, key, value);
        }
        if slider.drag_stopped() || slider.lost_focus() || (slider.changed() && !slider.dragged()) {
            cockpit.settings.sea = cockpit.sea_text.clone();
        }
    }
}

/// Where waves break.
fn surf(ui: &mut Ui, surf: Option<Surf>) {
    if let Some(Surf { height, depth, width }) = surf {
        let words = format!("waves of {height:.1} m break in {depth:.1} m of water: surf about {width:.0} m wide");
        ui.label(RichText::new(words).weak().small())
            .on_hover_text("Significant height; in the mean along the shore. It follows from waves, bed and breaking");
    }
}

//! Light and colours.

use super::section;
use crate::calendar;
use crate::cockpit::Cockpit;
use crate::settings::{Settings, Style, SunBy};
use egui::{DragValue, RichText, Slider, TextEdit, Ui};
use glam::DVec2;
use littoral::picture::Sun;
use std::path::Path;

/// Style, sun, air and stretched heights.
pub fn show(ui: &mut Ui, cockpit: &mut Cockpit) {
    section(ui, "Light and colours", true, |ui| {
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 2.0;
            for each in Style::ALL {
                let (name, does) = each.words();
                ui.selectable_value(&mut cockpit.settings.style, each, name).on_hover_text(does);
            }
        });
        if cockpit.settings.style == Style::Image {
            picture(ui, cockpit);
        }
        sun(ui, cockpit);
        air(ui, &mut cockpit.settings);
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

/// The picture that is laid over the ground.
fn picture(ui: &mut Ui, cockpit: &mut Cockpit) {
    ui.horizontal(|ui| {
        let field = TextEdit::singleline(&mut cockpit.picture_text).desired_width(190.0).hint_text("a picture's file");
        let entered = ui.add(field).lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        if ui.button("Lay").clicked() || entered {
            let file = cockpit.picture_text.trim().to_owned();
            match file.is_empty() {
                true => cockpit.note("expected the name of a picture's file, got none; type one, or drop a picture"),
                false => cockpit.lay(Path::new(&file)),
            }
        }
    });
    if cockpit.picture().is_none() {
        ui.label(RichText::new("Drop a picture on the window to lay it over this land.").weak().small());
    }
}

/// How far one sees.
fn air(ui: &mut Ui, settings: &mut Settings) {
    /// A clear day (km).
    const CLEAR: f64 = 40.0;
    ui.horizontal(|ui| {
        let mut own = settings.visibility_kilometres == 0.0;
        if ui.checkbox(&mut own, "visibility as suits").changed() {
            settings.visibility_kilometres = if own { 0.0 } else { CLEAR };
        }
    });
    if settings.visibility_kilometres > 0.0 {
        let visibility = Slider::new(&mut settings.visibility_kilometres, 0.5..=300.0).logarithmic(true);
        ui.add(visibility.custom_formatter(|n, _| kilometres(n)).text("visibility"))
            .on_hover_text("Below 1 km: fog; 4: mist; 10: haze; 40: a clear day; 200: the clearest air");
    }
}

/// A distance (km) for people.
fn kilometres(distance: f64) -> String {
    match distance {
        d if d < 1.0 => format!("{:.0} m", d * 1000.0),
        d if d < 10.0 => format!("{d:.1} km"),
        d => format!("{d:.0} km"),
    }
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

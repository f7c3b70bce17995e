//! What is drawn over the picture: the line between two methods, the path, and what a frozen view sees.

use crate::cockpit::Cockpit;
use crate::scene::Choice;
use egui::{Align2, Color32, Ui};
use glam::{DVec3, UVec2, Vec2};

/// The path, and what a frozen view sees, drawn over the picture.
pub fn show(ui: &Ui, cockpit: &Cockpit, size: UVec2) {
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

/// The line between two pictures: its handle can be dragged.
pub fn divider(ui: &Ui, cockpit: &mut Cockpit) {
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

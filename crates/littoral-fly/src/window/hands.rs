//! What hands do: keys, mouse and gamepads.

use super::Flight;
use crate::camera::{Hands, Mode};
use crate::keys;
use crate::settings::{Show, Split, Style};
use glam::{DVec2, Vec2};
use littoral::lod::Method;
use std::path::Path;
use winit::event::MouseButton;
use winit::event_loop::ActiveEventLoop;
use winit::keyboard::KeyCode;

impl Flight {
    /// What keys ask for.
    #[cfg(not(feature = "gamepad"))]
    pub fn hands(&mut self, _: &ActiveEventLoop) -> Hands {
        keys::hands(&self.held)
    }

    /// What keys and gamepads ask for.
    #[cfg(feature = "gamepad")]
    pub fn hands(&mut self, events: &ActiveEventLoop) -> Hands {
        use crate::gamepad::{Gamepads, Pressed, both};
        let (pads, buttons) = self.gamepads.as_mut().map(Gamepads::read).unwrap_or_default();
        for button in buttons {
            match button {
                Pressed::Key(key) => self.pressed(key, events),
                Pressed::NextMode => {
                    self.cockpit.change_mode(neighbour(&Mode::ALL, self.cockpit.camera.mode(), false));
                }
                Pressed::Faster(by) => self.cockpit.faster(by),
            }
        }
        both(&keys::hands(&self.held), &pads)
    }

    /// A key that was pressed.
    pub fn pressed(&mut self, key: KeyCode, events: &ActiveEventLoop) {
        let held = |keys: [KeyCode; 2]| keys.iter().any(|key| self.held.contains(key));
        let control = held([KeyCode::ControlLeft, KeyCode::ControlRight]);
        let shift = held([KeyCode::ShiftLeft, KeyCode::ShiftRight]);
        let size = self.paint.size();
        let cockpit = &mut self.cockpit;
        if control {
            match key {
                KeyCode::KeyZ if shift => cockpit.editor.redo(),
                KeyCode::KeyZ => cockpit.editor.undo(),
                KeyCode::KeyY => cockpit.editor.redo(),
                KeyCode::KeyS => cockpit.save_path(),
                KeyCode::KeyO => {
                    let file = cockpit.path_file.clone();
                    cockpit.load_path(Path::new(file.trim()));
                }
                KeyCode::KeyQ => events.exit(),
                _ => {}
            }
            return;
        }
        let settings = &mut cockpit.settings;
        match key {
            KeyCode::F1 => self.shown.help = !self.shown.help,
            KeyCode::Escape => self.shown.help = false,
            KeyCode::Tab => settings.panel = !settings.panel,
            KeyCode::F12 => self.pictures.push(shift),
            KeyCode::Digit1 => cockpit.change_mode(Mode::Fly),
            KeyCode::Digit2 => cockpit.change_mode(Mode::Orbit),
            KeyCode::Digit3 => cockpit.change_mode(Mode::Walk),
            KeyCode::Digit4 => cockpit.change_mode(Mode::Boat),
            KeyCode::Home => cockpit.home(),
            KeyCode::KeyM => settings.first.method = neighbour(&Method::ALL, settings.first.method, shift),
            KeyCode::KeyV => settings.split = neighbour(&Split::ALL, settings.split, shift),
            KeyCode::KeyX => settings.show = neighbour(&Show::ALL, settings.show, shift),
            KeyCode::KeyT => settings.style = neighbour(&Style::ALL, settings.style, shift),
            KeyCode::Equal | KeyCode::NumpadAdd => {
                settings.first.tolerance_pixels = (settings.first.tolerance_pixels / 1.25).max(0.1);
            }
            KeyCode::Minus | KeyCode::NumpadSubtract => {
                settings.first.tolerance_pixels = (settings.first.tolerance_pixels * 1.25).min(50.0);
            }
            KeyCode::KeyF => cockpit.freeze(size),
            KeyCode::KeyL => cockpit.editing = !cockpit.editing,
            KeyCode::KeyB => {
                let subject = cockpit.subject.clone();
                cockpit.editor.add_eye(cockpit.camera.eye, &|at| subject.as_ref()?.surface(at));
            }
            KeyCode::Delete => {
                if let Some(point) = cockpit.editor.selected {
                    cockpit.editor.remove(point);
                }
            }
            KeyCode::KeyP => cockpit.play(),
            KeyCode::KeyR => self.toggle_film(),
            KeyCode::Space if cockpit.playing.is_some() => cockpit.paused = !cockpit.paused,
            KeyCode::Space => cockpit.still = !cockpit.still,
            _ => {}
        }
    }

    /// A button of the mouse over the picture.
    pub fn button(&mut self, button: MouseButton, down: bool) {
        if !down {
            if self.looking == Some(button) {
                self.looking = None;
            }
            if button == MouseButton::Left {
                self.dragged = None;
                self.cockpit.editor.release();
            }
            return;
        }
        if button == MouseButton::Left && self.cockpit.editing {
            let Some(subject) = self.cockpit.subject.clone() else { return };
            let view = self.cockpit.view(self.paint.size());
            let scale = self.egui.egui_ctx().pixels_per_point();
            let surface = |at| subject.surface(at);
            match self.cockpit.editor.pick(&view, self.cursor, 10.0 * scale, &surface) {
                Some(point) => {
                    self.cockpit.editor.selected = Some(point);
                    self.dragged = Some(point);
                }
                None => match subject.seen(&view, self.cursor) {
                    Some(place) => {
                        self.cockpit.editor.add(place);
                        self.dragged = self.cockpit.editor.selected;
                    }
                    None => self.cockpit.note("expected a click on the ground, got one on the sky; click lower"),
                },
            }
        } else {
            self.looking = Some(button);
        }
    }

    /// The mouse is elsewhere.
    pub fn moved(&mut self, to: Vec2) {
        let by = to - self.cursor;
        self.cursor = to;
        if let (Some(point), Some(subject)) = (self.dragged, self.cockpit.subject.clone()) {
            // A click that trembles drags nothing.
            let view = self.cockpit.view(self.paint.size());
            if by.length() > 0.0
                && let Some(place) = subject.seen(&view, to)
            {
                self.cockpit.editor.move_to(point, place.truncate());
            }
        } else if self.looking.is_some() {
            let radians = 1.0 / f64::from(self.cockpit.view(self.paint.size()).pixels_per_radian);
            // The ground under the cursor follows it.
            self.cockpit.camera.look(DVec2::new(-f64::from(by.x), f64::from(by.y)) * radians);
        }
    }

    /// The wheel was turned over the picture, by so many notches.
    pub fn wheel(&mut self, by: f64) {
        let cockpit = &mut self.cockpit;
        if let (true, Some(point)) = (cockpit.editing, cockpit.editor.selected) {
            let surface = {
                let subject = cockpit.subject.clone();
                move |at| subject.as_ref()?.surface(at)
            };
            let far = cockpit.editor.position(point, &surface).map_or(100.0, |at| at.distance(cockpit.camera.eye));
            cockpit.editor.raise(point, (by * 0.01 * far).round());
        } else if cockpit.camera.mode() == Mode::Orbit {
            cockpit.camera.zoom(0.15 * by);
        } else {
            cockpit.faster(1.2f64.powf(by));
        }
    }
}

/// The next of a list, or the one before.
fn neighbour<T: Copy + PartialEq>(all: &[T], now: T, back: bool) -> T {
    let at = all.iter().position(|each| *each == now).unwrap_or(0);
    all[(at + if back { all.len() - 1 } else { 1 }) % all.len()]
}

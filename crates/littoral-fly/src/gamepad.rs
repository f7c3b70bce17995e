//! Gamepads: sticks and triggers are hands, buttons do what keys do.

use crate::camera::Hands;
use gilrs::{Axis, Button, EventType, Gilrs};
use glam::Vec2;
use winit::keyboard::KeyCode;

/// What is said of a gamepad: its parts, and what they do.
pub const HELP: [(&str, &str); 5] = [
    ("Pad: sticks", "left: forward, back, left, right; right: look round"),
    ("Pad: triggers", "right: up; left: down"),
    ("Pad: shoulders", "right: in a hurry; left and right of the cross: the style, textured or wireframe"),
    ("Pad: cross", "up, down: faster, slower"),
    (
        "Pad: A B X Y",
        "stop the sea, the first view, the next method, the next way of moving; Start: this help, Select: panel",
    ),
];

/// What a button asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pressed {
    /// What a key does.
    Key(KeyCode),
    /// The next way of moving.
    NextMode,
    /// So many times faster.
    Faster(f64),
}

/// How a gamepad is held.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Pad {
    /// Left stick, right and up.
    left: Vec2,
    /// Right stick, right and up.
    right: Vec2,
    /// Left trigger, from 0 to 1.
    down: f32,
    /// Right trigger.
    up: f32,
    /// Whether the right shoulder is pressed.
    fast: bool,
}

/// A stick rests within this of its middle.
const DEAD: f32 = 0.15;

/// What a stick asks for: nothing near its middle, and finely around it.
fn stick(at: Vec2) -> Vec2 {
    let length = at.length();
    if length <= DEAD || !length.is_finite() {
        return Vec2::ZERO;
    }
    let pushed = ((length - DEAD) / (1.0 - DEAD)).min(1.0);
    at / length * pushed * pushed
}

fn hands(pad: &Pad) -> Hands {
    let (left, right) = (stick(pad.left), stick(pad.right));
    let trigger = |pressed: f32| if pressed > DEAD { f64::from((pressed - DEAD) / (1.0 - DEAD)).min(1.0) } else { 0.0 };
    Hands {
        forward: left.y.into(),
        right: left.x.into(),
        up: trigger(pad.up) - trigger(pad.down),
        turn: right.x.into(),
        tilt: right.y.into(),
        fast: pad.fast,
    }
}

/// What two pairs of hands ask for together.
pub fn both(one: &Hands, other: &Hands) -> Hands {
    let sum = |a: f64, b: f64| (a + b).clamp(-1.0, 1.0);
    Hands {
        forward: sum(one.forward, other.forward),
        right: sum(one.right, other.right),
        up: sum(one.up, other.up),
        turn: sum(one.turn, other.turn),
        tilt: sum(one.tilt, other.tilt),
        fast: one.fast || other.fast,
    }
}

fn pressed(button: Button) -> Option<Pressed> {
    Some(match button {
        Button::South => Pressed::Key(KeyCode::Space),
        Button::East => Pressed::Key(KeyCode::Home),
        Button::West => Pressed::Key(KeyCode::KeyM),
        Button::North => Pressed::NextMode,
        Button::Start => Pressed::Key(KeyCode::F1),
        Button::Select => Pressed::Key(KeyCode::Tab),
        Button::DPadLeft => Pressed::Key(KeyCode::KeyT),
        Button::DPadRight => Pressed::Key(KeyCode::KeyX),
        Button::DPadUp => Pressed::Faster(1.25),
        Button::DPadDown => Pressed::Faster(0.8),
        _ => return None,
    })
}

/// All gamepads there are, also those that are plugged in later.
pub struct Gamepads(Gilrs);

impl Gamepads {
    /// Where the system lets them be read.
    pub fn new() -> Option<Gamepads> {
        Gilrs::new().ok().map(Gamepads)
    }

    /// What their sticks and triggers ask for together, and which buttons were pressed since the last time.
    pub fn read(&mut self) -> (Hands, Vec<Pressed>) {
        let mut buttons = Vec::new();
        while let Some(event) = self.0.next_event() {
            if let EventType::ButtonPressed(button, _) = event.event {
                buttons.extend(pressed(button));
            }
        }
        let mut all = Hands::default();
        for (_, pad) in self.0.gamepads() {
            let trigger = |button| pad.button_data(button).map_or(0.0, |data| data.value());
            let own = hands(&Pad {
                left: Vec2::new(pad.value(Axis::LeftStickX), pad.value(Axis::LeftStickY)),
                right: Vec2::new(pad.value(Axis::RightStickX), pad.value(Axis::RightStickY)),
                down: trigger(Button::LeftTrigger2),
                up: trigger(Button::RightTrigger2),
                fast: pad.is_pressed(Button::RightTrigger),
            });
            all = both(&all, &own);
        }
        (all, buttons)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sticks_and_triggers_are_hands() {
        assert_eq!(hands(&Pad::default()), Hands::default());
        let worn = Pad { left: Vec2::new(0.1, -0.1), right: Vec2::new(-0.08, 0.05), down: 0.1, ..Pad::default() };
        assert_eq!(hands(&worn), Hands::default(), "worn sticks do not drift");
        let pad = Pad { left: Vec2::new(0.0, 1.0), right: Vec2::new(-1.0, 0.0), up: 1.0, fast: true, ..Pad::default() };
        let full = Hands { forward: 1.0, turn: -1.0, up: 1.0, fast: true, ..Hands::default() };
        assert_eq!(hands(&pad), full);
        let slight = hands(&Pad { left: Vec2::new(0.0, 0.5), ..Pad::default() }).forward;
        assert!(slight > 0.1 && slight < 0.3, "finely around the middle: {slight}");
        // Corners of square sticks are no faster, and broken ones ask for nothing.
        let corner = hands(&Pad { left: Vec2::new(1.0, 1.0), ..Pad::default() });
        assert!((corner.forward.hypot(corner.right) - 1.0).abs() < 1e-6);
        assert_eq!(hands(&Pad { right: Vec2::new(f32::NAN, 1.0), ..Pad::default() }), Hands::default());
        assert_eq!(hands(&Pad { up: 1.0, down: 1.0, ..Pad::default() }).up, 0.0, "opposites cancel");
    }

    #[test]
    fn hands_on_keys_and_pads_add_up() {
        let key = Hands { forward: 1.0, turn: -1.0, ..Hands::default() };
        let pad = Hands { forward: 0.5, turn: 1.0, fast: true, ..Hands::default() };
        assert_eq!(both(&key, &pad), Hands { forward: 1.0, fast: true, ..Hands::default() });
    }

    #[test]
    fn buttons_do_what_the_help_says() {
        assert_eq!(pressed(Button::South), Some(Pressed::Key(KeyCode::Space)));
        assert_eq!(pressed(Button::North), Some(Pressed::NextMode));
        assert_eq!(pressed(Button::DPadUp), Some(Pressed::Faster(1.25)));
        assert_eq!(pressed(Button::RightTrigger2), None, "a trigger is no button");
    }
}

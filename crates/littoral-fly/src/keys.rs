//! Which key does what: one table for the hands, the help and the manual.

use crate::camera::Hands;
use std::collections::HashSet;
use winit::keyboard::KeyCode;

/// What is said of the keys: keys, and what they do.
pub const HELP: [(&str, &str); 23] = [
    ("W S A D", "forward, back, left, right; on a boat: throttle and rudder; on an orbit: nearer, farther, round"),
    ("E Q", "up, down"),
    ("arrows, drag", "look round"),
    ("Shift", "in a hurry"),
    ("mouse wheel", "faster, slower; on an orbit: nearer, farther"),
    ("1 2 3 4", "fly, orbit what is in the middle, walk, boat"),
    ("Home", "back to the first view"),
    ("M", "the next method of detail (Shift: the one before)"),
    ("V", "one method, two side by side, how they differ"),
    ("+ -", "a finer, a coarser tolerance"),
    ("X", "textured, wireframe, both"),
    ("T", "the next style"),
    ("F", "freeze the triangles, and look at them from elsewhere"),
    ("Space", "stop the sea, or a flight along a path"),
    ("L", "edit the path: click the ground to add points, drag them, wheel to raise them"),
    ("B", "add the eye's place to the path"),
    ("Delete", "remove the selected point"),
    ("Ctrl+Z Ctrl+Y", "undo, redo"),
    ("Ctrl+S Ctrl+O", "save, load the path"),
    ("P", "fly along the path, or stop to"),
    ("R", "film the path: a picture for each moment, none left out"),
    ("F12", "a picture of what is seen, as PNG (Shift: with the panel)"),
    ("Tab, F1, Ctrl+Q", "panel, this help, quit"),
];

/// What the keys that are held ask for.
pub fn hands(held: &HashSet<KeyCode>) -> Hands {
    let axis = |plus: &[KeyCode], minus: &[KeyCode]| {
        let any = |keys: &[KeyCode]| f64::from(u8::from(keys.iter().any(|key| held.contains(key))));
        any(plus) - any(minus)
    };
    if [KeyCode::ControlLeft, KeyCode::ControlRight].iter().any(|key| held.contains(key)) {
        return Hands::default(); // part of a command
    }
    Hands {
        forward: axis(&[KeyCode::KeyW], &[KeyCode::KeyS]),
        right: axis(&[KeyCode::KeyD], &[KeyCode::KeyA]),
        up: axis(&[KeyCode::KeyE], &[KeyCode::KeyQ]),
        turn: axis(&[KeyCode::ArrowRight], &[KeyCode::ArrowLeft]),
        tilt: axis(&[KeyCode::ArrowUp], &[KeyCode::ArrowDown]),
        fast: held.contains(&KeyCode::ShiftLeft) || held.contains(&KeyCode::ShiftRight),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn held_keys_are_hands() {
        let held = |keys: &[KeyCode]| hands(&keys.iter().copied().collect());
        let expected = Hands { forward: 1.0, turn: -1.0, fast: true, ..Hands::default() };
        assert_eq!(held(&[KeyCode::KeyW, KeyCode::ArrowLeft, KeyCode::ShiftLeft]), expected);
        assert_eq!(held(&[KeyCode::KeyW, KeyCode::KeyS]), Hands::default(), "opposites cancel");
        assert_eq!(held(&[KeyCode::ControlLeft, KeyCode::KeyS]), Hands::default(), "saving is no flying back");
    }
}

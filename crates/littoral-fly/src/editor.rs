//! The path that is being made: points that are added, moved, raised and removed, each step of which can be undone.

use glam::{DVec2, DVec3, Vec2};
use littoral::flight::{FlightPath, Level, Look, Spot, Waypoint};
use littoral::space::View;

/// What heights the editor may ask for: ground or still water (m) at a place.
pub type Surface<'a> = &'a dyn Fn(DVec2) -> Option<f64>;

/// A path at work.
#[derive(Clone, Debug)]
pub struct Editor {
    path: FlightPath,
    /// Which point is changed by what has no other.
    pub selected: Option<usize>,
    /// How high above the ground new points are (m).
    pub above: f64,
    /// Whether heights of new points move with the ground.
    pub relative: bool,
    past: Vec<FlightPath>,
    future: Vec<FlightPath>,
    /// What is going on that shall be undone as one: a point being dragged.
    going: Option<(usize, Change)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Change {
    Moved,
    Raised,
}

/// So many steps can be undone.
const STEPS: usize = 200;

impl Default for Editor {
    fn default() -> Editor {
        Editor {
            path: FlightPath::default(),
            selected: None,
            above: 80.0,
            relative: true,
            past: Vec::new(),
            future: Vec::new(),
            going: None,
        }
    }
}

impl Editor {
    /// The path as it is.
    pub fn path(&self) -> &FlightPath {
        &self.path
    }

    /// Another path, as one step.
    pub fn replace(&mut self, path: FlightPath) {
        if path != self.path {
            self.remember();
            self.path = path;
            self.selected = self.selected.filter(|i| *i < self.path.points.len());
        }
    }

    fn remember(&mut self) {
        self.going = None;
        self.future.clear();
        if self.past.len() == STEPS {
            self.past.remove(0);
        }
        self.past.push(self.path.clone());
    }

    fn remember_once(&mut self, point: usize, change: Change) {
        if self.going != Some((point, change)) {
            self.remember();
            self.going = Some((point, change));
        }
    }

    /// Ends what is going on: the next change is a step of its own.
    pub fn release(&mut self) {
        self.going = None;
    }

    /// Whether there is something to undo, and to do again.
    pub fn can_undo(&self) -> (bool, bool) {
        (!self.past.is_empty(), !self.future.is_empty())
    }

    /// Takes the last step back.
    pub fn undo(&mut self) {
        if let Some(path) = self.past.pop() {
            self.future.push(std::mem::replace(&mut self.path, path));
            self.settle();
        }
    }

    /// Takes it again.
    pub fn redo(&mut self) {
        if let Some(path) = self.future.pop() {
            self.past.push(std::mem::replace(&mut self.path, path));
            self.settle();
        }
    }

    fn settle(&mut self) {
        self.going = None;
        self.selected = self.selected.filter(|i| *i < self.path.points.len());
    }

    /// Adds a point over a place on the ground (m): after the selected one, or at the end. It is selected then.
    pub fn add(&mut self, on_ground: DVec3) {
        let level = match self.relative {
            true => Level::AboveGround(self.above),
            false => Level::Absolute(on_ground.z + self.above),
        };
        self.insert(Spot { xy: on_ground.truncate(), level });
    }

    /// Adds the place where the eye is.
    pub fn add_eye(&mut self, eye: DVec3, surface: Surface) {
        let level = match surface(eye.truncate()).filter(|_| self.relative) {
            Some(ground) => Level::AboveGround(eye.z - ground),
            None => Level::Absolute(eye.z),
        };
        self.insert(Spot { xy: eye.truncate(), level });
    }

    fn insert(&mut self, spot: Spot) {
        let twin = |p: &Waypoint| (p.spot.xy - spot.xy).length() < 0.01 && p.spot.level == spot.level;
        let at = self.selected.map_or(self.path.points.len(), |i| i + 1);
        let beside = [at.checked_sub(1), Some(at)].into_iter().flatten();
        if beside.filter_map(|i| self.path.points.get(i)).any(twin) {
            return; // a double click is one point
        }
        self.remember();
        self.path.points.insert(at, Waypoint { spot, look: Look::Ahead { pitch: None } });
        self.selected = Some(at);
    }

    /// Moves a point over another place (m); its height stays counted from what it was.
    pub fn move_to(&mut self, point: usize, xy: DVec2) {
        if point < self.path.points.len() && xy.is_finite() {
            self.remember_once(point, Change::Moved);
            self.path.points[point].spot.xy = xy;
        }
    }

    /// Raises a point (m).
    pub fn raise(&mut self, point: usize, by: f64) {
        if point < self.path.points.len() && by.is_finite() && by != 0.0 {
            self.remember_once(point, Change::Raised);
            let (Level::AboveGround(z) | Level::Absolute(z)) = &mut self.path.points[point].spot.level;
            *z += by;
        }
    }

    /// Counts a point's height from the ground or from sea level; the point stays where it is.
    pub fn set_relative(&mut self, point: usize, relative: bool, surface: Surface) {
        let Some(spot) = self.path.points.get(point).map(|p| p.spot) else { return };
        let Some(ground) = surface(spot.xy) else { return };
        let level = match (spot.level, relative) {
            (Level::Absolute(z), true) => Level::AboveGround(z - ground),
            (Level::AboveGround(above), false) => Level::Absolute(ground + above),
            _ => return,
        };
        self.remember();
        self.path.points[point].spot.level = level;
    }

    /// Removes a point; its neighbour is selected.
    pub fn remove(&mut self, point: usize) {
        if point < self.path.points.len() {
            self.remember();
            self.path.points.remove(point);
            self.selected = (!self.path.points.is_empty()).then(|| point.saturating_sub(1));
        }
    }

    /// Removes all points.
    pub fn clear(&mut self) {
        if !self.path.points.is_empty() {
            self.remember();
            self.path.points.clear();
            self.selected = None;
        }
    }

    /// Where a point is (m); on the datum where there is no ground to count from.
    pub fn position(&self, point: usize, surface: Surface) -> Option<DVec3> {
        let spot = self.path.points.get(point)?.spot;
        Some(spot.xy.extend(match spot.level {
            Level::AboveGround(above) => surface(spot.xy).unwrap_or(0.0) + above,
            Level::Absolute(z) => z,
        }))
    }

    /// The point seen within so many pixels of a place in the picture, the nearest one first.
    pub fn pick(&self, view: &View, cursor: Vec2, within: f32, surface: Surface) -> Option<usize> {
        (0..self.path.points.len())
            .filter_map(|i| Some((i, view.pixel(self.position(i, surface)?)?.distance(cursor))))
            .filter(|(_, distance)| *distance <= within)
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(i, _)| i)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::UVec2;
    use littoral::flight::Interpolation;
    use littoral_data::path::{Coordinates, SavedPath};

    fn hill(at: DVec2) -> Option<f64> {
        (at.x >= 0.0).then_some(100.0 + 0.1 * at.x)
    }

    fn on(x: f64, y: f64) -> DVec3 {
        DVec2::new(x, y).extend(hill(DVec2::new(x, y)).unwrap_or(0.0))
    }

    fn three() -> Editor {
        let mut editor = Editor::default();
        [on(0.0, 0.0), on(1000.0, 0.0), on(1000.0, 1000.0)].into_iter().for_each(|at| editor.add(at));
        editor
    }

    #[test]
    fn points_are_added_inserted_and_removed() {
        let mut editor = three();
        assert_eq!(editor.selected, Some(2));
        editor.selected = Some(0);
        editor.add(on(500.0, -100.0));
        let xs = |editor: &Editor| editor.path().points.iter().map(|p| p.spot.xy.x).collect::<Vec<_>>();
        assert_eq!((xs(&editor), editor.selected), (vec![0.0, 500.0, 1000.0, 1000.0], Some(1)));
        editor.add(on(500.0, -100.0));
        assert_eq!(editor.path().points.len(), 4, "a double click is one point");
        editor.remove(2);
        assert_eq!((xs(&editor), editor.selected), (vec![0.0, 500.0, 1000.0], Some(1)));
        editor.remove(7);
        editor.move_to(7, DVec2::ONE);
        editor.raise(7, 1.0);
        assert_eq!(editor.path().points.len(), 3, "points that are not there are no trouble");
    }

    #[test]
    fn heights_are_relative_or_absolute_and_change_without_a_jump() {
        let mut editor = three();
        assert_eq!(editor.path().points[1].spot.level, Level::AboveGround(80.0));
        let before = editor.position(1, &hill).expect("there");
        assert_eq!(before, DVec3::new(1000.0, 0.0, 280.0));
        editor.set_relative(1, false, &hill);
        assert_eq!(editor.path().points[1].spot.level, Level::Absolute(280.0));
        assert_eq!(editor.position(1, &hill), Some(before));
        editor.raise(1, -30.0);
        editor.set_relative(1, true, &hill);
        assert_eq!(editor.path().points[1].spot.level, Level::AboveGround(50.0));
        editor.relative = false;
        editor.add(on(10.0, 10.0));
        assert_eq!(editor.path().points[3].spot.level, Level::Absolute(101.0 + 80.0));
        // Where there is no ground a height cannot be counted from it.
        editor.add_eye(DVec3::new(-50.0, 0.0, 400.0), &hill);
        assert_eq!(editor.path().points[4].spot.level, Level::Absolute(400.0));
        editor.set_relative(4, true, &hill);
        assert_eq!(editor.path().points[4].spot.level, Level::Absolute(400.0));
    }

    #[test]
    fn each_step_is_undone_and_a_drag_is_one() {
        let mut editor = three();
        let before = editor.path().clone();
        for x in 0..20 {
            editor.move_to(1, DVec2::new(f64::from(x), 5.0));
        }
        editor.release();
        editor.raise(1, 5.0);
        editor.raise(1, 5.0);
        editor.replace(FlightPath { closed: true, ..editor.path().clone() });
        let after = editor.path().clone();
        for _ in 0..3 {
            editor.undo();
        }
        assert_eq!(*editor.path(), before);
        for _ in 0..3 {
            editor.redo();
        }
        assert_eq!(*editor.path(), after);
        assert_eq!(editor.can_undo(), (true, false));
        for _ in 0..50 {
            editor.undo();
        }
        assert!(editor.path().points.is_empty() && editor.selected.is_none());
        editor.add(on(1.0, 1.0));
        assert_eq!(editor.can_undo(), (true, false), "a new step ends what could be done again");
    }

    #[test]
    fn the_point_under_the_cursor_is_picked() {
        let editor = three();
        let eye = DVec3::new(-800.0, -1500.0, 900.0);
        let view = View::looking_at(eye, DVec3::new(600.0, 300.0, 200.0), 1.0, UVec2::new(1280, 720));
        for i in 0..3 {
            let at = view.pixel(editor.position(i, &hill).expect("there")).expect("in front");
            assert_eq!(editor.pick(&view, at + Vec2::new(3.0, -4.0), 6.0, &hill), Some(i));
            assert_eq!(editor.pick(&view, at + Vec2::new(30.0, -4.0), 6.0, &hill), None);
        }
    }

    #[test]
    fn the_three_interpolations_pass_the_points_and_are_saved() {
        let folder = tempfile::tempdir().expect("a folder");
        for interpolation in [Interpolation::Straight, Interpolation::CatmullRom, Interpolation::Smooth] {
            let mut editor = three();
            editor.replace(FlightPath { interpolation, ..editor.path().clone() });
            let ground = |at: DVec2| hill(at);
            let flight = editor.path().over(&ground).expect("flies");
            for i in 0..3 {
                let point = editor.position(i, &hill).expect("there");
                let nearest = (0..=2000)
                    .map(|k| flight.pose(flight.duration() * f64::from(k) / 2000.0).position.distance(point))
                    .fold(f64::INFINITY, f64::min);
                assert!(nearest < 2.0, "{interpolation:?} misses point {i} by {nearest} m");
            }
            let file = folder.path().join("path.toml");
            let saved = SavedPath { coordinates: Coordinates::Metres, path: editor.path().clone() };
            saved.save(&file).expect("saved");
            assert_eq!(SavedPath::load(&file).expect("loaded"), saved);
        }
    }
}

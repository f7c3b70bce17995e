//! Text with a place and a height on each line, in any order of lines and with any separator, if the places form a regular
//! grid. Read twice: first to find the grid, then to fill it, so that no list of points is kept. Places are told apart at a
//! thousandth of the distance of the first two points, which forgives rounding.

use super::text::{Lines, not_a_number, number};
use super::{Input, assume_degrees, check_fits, crs_from_sidecar, info};
use crate::voids::VoidRule;
use crate::{Error, Georeference, MemorySource, Registration, Source};
use std::collections::HashSet;

/// A grid of which fewer than one place in so many has a point is no grid.
const SPARSEST: u64 = 16;

/// Whether the first lines hold three numbers, after comments or one line of names.
pub fn sniff(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    // The last line of the head may be cut through, unless it is all there is.
    let mut lines: Vec<&str> = text.trim_start_matches('\u{feff}').lines().filter(|l| !is_comment(l)).take(3).collect();
    if lines.first().is_some_and(|line| names(line).is_some()) {
        lines.remove(0);
    }
    if lines.len() > 1 {
        lines.truncate(lines.len() - 1);
    }
    let numbers =
        |line: &&str| words(line).take(3).filter(|w| number(w).is_some()).count() == 3 || decimal_commas(line);
    !lines.is_empty() && lines.iter().all(numbers)
}

fn is_comment(line: &str) -> bool {
    let line = line.trim();
    line.is_empty() || line.starts_with(['#', '%', '!']) || line.starts_with("//")
}

/// Which columns are x, y and height, if this is a line of names.
fn names(line: &str) -> Option<[usize; 3]> {
    let words: Vec<String> = words(line).map(|w| w.trim_matches(['"', '\'']).to_lowercase()).collect();
    if words.len() < 3 || !words.iter().all(|w| number(w).is_none()) {
        return None;
    }
    let find = |known: &[&str]| words.iter().position(|w| known.contains(&w.as_str()));
    let x = find(&["x", "lon", "long", "longitude", "easting", "east", "e"]);
    let y = find(&["y", "lat", "latitude", "northing", "north", "n"]);
    let z = find(&["z", "h", "height", "elevation", "elev", "altitude", "alt", "depth", "dem", "value"]);
    Some(match (x, y, z) {
        (Some(x), Some(y), Some(z)) => [x, y, z],
        (Some(x), Some(y), None) => [x, y, (0..3).find(|c| *c != x && *c != y).unwrap_or(2)],
        _ => [0, 1, 2],
    })
}

fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| c.is_whitespace() || c == ',' || c == ';' || c == '|').filter(|w| !w.is_empty())
}

/// Three words between white space or semicolons, with a comma inside each that has digits on both sides: `1,5 2,5 3,5`.
fn decimal_commas(line: &str) -> bool {
    let inside = |word: &str| {
        word.split_once(',').is_some_and(|(a, b)| a.ends_with(|c: char| c.is_ascii_digit()) && number(b).is_some())
    };
    let words: Vec<&str> = line.split(|c: char| c.is_whitespace() || c == ';').filter(|w| !w.is_empty()).collect();
    words.len() >= 3 && words[..3].iter().all(|w| inside(w))
}

/// One direction of the grid while it is being found.
struct Axis {
    /// Places told apart, in units of `quantum`.
    seen: HashSet<i64>,
    low: f64,
    high: f64,
}

impl Axis {
    fn new() -> Axis {
        Axis { seen: HashSet::new(), low: f64::INFINITY, high: f64::NEG_INFINITY }
    }

    fn add(&mut self, at: f64, quantum: f64) -> bool {
        let key = (at / quantum).round();
        self.seen.insert(key as i64);
        self.low = self.low.min(at);
        self.high = self.high.max(at);
        key.abs() < 9e15
    }

    /// How many steps lead from the lowest place to the highest, if all lie on whole ones.
    fn steps(&self, quantum: f64) -> Option<u64> {
        let mut keys: Vec<i64> = self.seen.iter().copied().collect();
        keys.sort_unstable();
        let [first, last] = [*keys.first()?, *keys.last()?];
        if first == last {
            return Some(0);
        }
        // Neighbours within a few quanta are one place, rounded differently.
        let gaps = keys.windows(2).map(|k| k[1] - k[0]).filter(|&gap| gap > 20);
        let span = (self.high - self.low) / quantum;
        let steps = (span / gaps.min()? as f64).round();
        if !(1.0..1e9).contains(&steps) {
            return None;
        }
        let step = span / steps;
        let on_grid = keys.iter().all(|&k| {
            let at = (k - first) as f64 / step;
            (at - at.round()).abs() <= 0.05
        });
        on_grid.then_some(steps as u64)
    }
}

/// Opens such a file.
///
/// # Errors
/// If a line is not three numbers, or the places form no regular grid.
pub fn open(mut input: Input) -> Result<Box<dyn Source>, Error> {
    let mut columns_at = None;
    let mut axes = [Axis::new(), Axis::new()];
    let mut first = None;
    let mut quantum = 0.0;
    let mut points = 0u64;
    let not_a_grid = "expected places on a regular grid, got scattered points; grid them with `gdal_grid`";
    each_point(&mut input, &mut columns_at, |[x, y, _]| {
        let [x0, y0] = *first.get_or_insert([x, y]);
        points += 1;
        if quantum == 0.0 {
            // Points at the very first place say nothing.
            let distance = (x - x0).abs().max((y - y0).abs());
            if distance == 0.0 {
                return Ok(());
            }
            quantum = distance / 1000.0;
            if !(quantum.is_normal() && axes[0].add(x0, quantum) && axes[1].add(y0, quantum)) {
                return Err(not_a_grid.into());
            }
        }
        let fine = axes[0].add(x, quantum) && axes[1].add(y, quantum);
        let places = axes[0].seen.len() as u64 * axes[1].seen.len() as u64;
        if fine && places <= SPARSEST * points + 4096 { Ok(()) } else { Err(not_a_grid.into()) }
    })?;
    if points == 0 {
        return Err(input.error("expected lines of x, y and height, got none"));
    }
    let steps = [axes[0].steps(quantum), axes[1].steps(quantum)];
    let [Some(across), Some(down)] = steps else { return Err(input.error(not_a_grid)) };
    if across == 0 || down == 0 {
        return Err(input.error(format!("expected a grid of points, got a line of {points}; a profile is no land")));
    }
    let [columns, rows] = [across as usize + 1, down as usize + 1];
    let samples = check_fits(&input, columns, rows, SPARSEST * points + 4096)?;
    let dx = (axes[0].high - axes[0].low) / across as f64;
    let dy = (axes[1].high - axes[1].low) / down as f64;
    let [west, north] = [axes[0].low, axes[1].high];
    drop(axes);

    let rule = VoidRule::default();
    let mut heights = vec![f32::NAN; samples];
    let mut whole = true;
    each_point(&mut input, &mut columns_at, |[x, y, z]| {
        let [column, row] = [((x - west) / dx).round() as usize, ((north - y) / dy).round() as usize];
        if let Some(height) = heights.get_mut(row.min(rows) * columns + column.min(columns - 1)) {
            *height = rule.height(z);
            whole &= z.fract() == 0.0;
        }
        Ok(())
    })?;
    let mut info = info("XYZ", columns, rows);
    info.georeference = Georeference {
        geotransform: [west - 0.5 * dx, dx, 0.0, north + 0.5 * dy, 0.0, -dy],
        registration: Registration::Point,
        crs: crs_from_sidecar(&input),
        size: [columns, rows],
        y_south: false,
    };
    assume_degrees(&mut info);
    info.step = if whole { 1.0 } else { 0.0 };
    let missing = samples as u64 - points.min(samples as u64);
    if missing > 0 {
        info.warnings.push(format!("{missing} places of the {columns} × {rows} grid have no point: they are void"));
    }
    Ok(Box::new(MemorySource::new(info, heights)))
}

/// Calls `take` for each point of the file. `columns_at` is found from a line of names, or is the first three.
fn each_point(
    input: &mut Input,
    columns_at: &mut Option<[usize; 3]>,
    mut take: impl FnMut([f64; 3]) -> Result<(), String>,
) -> Result<(), Error> {
    let name = input.name.clone();
    let mut lines = Lines::new(input)?;
    let mut first = true;
    loop {
        let count = lines.count + 1;
        let Some(line) = lines.next_line()? else { return Ok(()) };
        let line = line.trim_start_matches('\u{feff}');
        if is_comment(line) {
            continue;
        }
        let is_first = std::mem::replace(&mut first, false);
        if is_first && let Some(columns) = names(line) {
            *columns_at = Some(columns);
            continue;
        }
        let at = columns_at.unwrap_or([0, 1, 2]);
        let fails = |problem: String| Error::content(&name, format!("{problem} (line {count})"));
        if decimal_commas(line) {
            return Err(fails(not_a_number(words_at(line))));
        }
        let mut point = [f64::NAN; 3];
        for (index, word) in words(line).enumerate() {
            if let Some(axis) = at.iter().position(|a| *a == index) {
                point[axis] = number(word).ok_or_else(|| fails(not_a_number(word)))?;
            }
        }
        if !(point[0].is_finite() && point[1].is_finite()) {
            let shown: String = line.chars().take(40).collect();
            return Err(fails(format!("expected x, y and height, got {shown:?}")));
        }
        take(point).map_err(fails)?;
    }
}

/// The first word, commas and all.
fn words_at(line: &str) -> &str {
    line.split(|c: char| c.is_whitespace() || c == ';').find(|w| !w.is_empty()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use littoral::field::Window;

    fn read(text: &str) -> Result<(crate::Info, Vec<f32>), Error> {
        let mut source = open(Input::memory("t.xyz", text.as_bytes().to_vec()))?;
        let info = source.info().clone();
        let all = source.read(0, Window { column: 0, row: 0, columns: info.columns, rows: info.rows })?;
        Ok((info, all))
    }

    fn lines(separator: &str, order: impl Fn(usize) -> (usize, usize)) -> String {
        let line = |i: usize| {
            let (column, row) = order(i);
            let [x, y, z] = [1000 + 10 * column, 500 - 5 * row, 3 * row + column];
            format!("{x}{separator}{y}{separator}{z}\n")
        };
        (0..6).map(line).collect()
    }

    #[test]
    fn any_order_and_separator() {
        let expected: Vec<f32> = (0..6).map(|i| i as f32).collect();
        let orders: [&dyn Fn(usize) -> (usize, usize); 4] =
            [&|i| (i % 3, i / 3), &|i| (i / 2, i % 2), &|i| (i % 3, 1 - i / 3), &|i| {
                ((2 * i + i / 3) % 3, (i * 5 + 1) % 2)
            }];
        for order in &orders[..3] {
            for separator in [" ", "\t", ",", ", ", ";", " | "] {
                let (info, heights) = read(&lines(separator, order)).expect("reads");
                assert_eq!(heights, expected);
                assert_eq!(info.georeference.geotransform, [995.0, 10.0, 0.0, 502.5, 0.0, -5.0]);
                assert!(info.warnings.is_empty());
            }
        }
    }

    #[test]
    fn names_comments_and_holes() {
        let text = "# made by hand\n\"Lat\",\"Lon\",\"Elev\"\n50.0,8.0,1\n50.0,8.1,2\n50.1,8.0,3\n";
        assert!(sniff(text.as_bytes()));
        let (info, heights) = read(text).expect("reads");
        assert_eq!(heights[0], 3.0);
        assert!(heights[1].is_nan());
        assert_eq!(heights[2..], [1.0, 2.0]);
        assert!(info.warnings.iter().any(|w| w.contains("1 places")));
        assert!(matches!(info.georeference.crs, crate::Crs::Geographic { .. }));
    }

    #[test]
    fn rounded_thirds_of_a_degree_are_regular() {
        let text: String = (0..30)
            .flat_map(|row| {
                (0..40).map(move |column| {
                    format!("{:.6} {:.6} {row}\n", column as f64 / 1200.0, 45.0 + row as f64 / 1200.0)
                })
            })
            .collect();
        let (info, heights) = read(&text).expect("regular");
        assert_eq!([info.columns, info.rows], [40, 30]);
        assert!(heights.iter().all(|h| h.is_finite()));
    }

    #[test]
    fn what_is_no_grid_is_refused() {
        let scattered: String =
            (0..5000u64).map(|i| format!("{} {} 5\n", i * 7919 % 10_007, i * 104_729 % 10_009)).collect();
        for (text, words) in [
            (scattered.as_str(), "gdal_grid"),
            ("1 1 5\n2 1 5\n3 1 5\n", "line of"),
            ("1,5 2,5 3,5\n4,5 2,5 3,5\n", "decimal commas"),
            ("1 2 3\n2 2 3\nabc def ghi\n", "\"abc\""),
            ("1 2 3\n2 2\nnan 3 4\n", "x, y and height"),
            ("1 2 3\n1e300 2 3\n1 5e-300 3\n", "grid"),
            ("", "got none"),
            ("1 2 3\n1 2 3\n", "grid"),
        ] {
            let error = read(text).expect_err("must fail").to_string();
            assert!(error.contains(words), "{error}");
        }
        assert!(
            sniff(b"1,5 2,5 3,5\n")
                && !sniff(b"hello world\nfoo\n")
                && !sniff(b"1 2\n3 4\n")
                && sniff(b"x,y,z\n1,2,3\n")
        );
    }
}

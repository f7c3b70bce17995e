//! Sea states as they are typed: what the engine reads, and what a buoy measured.
//!
//! `buoy=FILE` makes the waves those of a buoy's record, the latest unless `record=` names one; `wind=`, `from=`, `swell=`, `depth=` and `seed=` may
//! stand beside it. A wind beside a buoy raises no further waves: it is the one that blows now. Without, the wind is taken that the buoy's
//! short waves tell of.

use crate::talk::{Failure, Talk, tidy};
use littoral::waves::{SeaState, Train, bearing_from_heading};
use littoral_data::waves::{Buoy, Record, Time, probable_wind};
use std::path::Path;

/// Which of a buoy's records.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Choice {
    /// The last one.
    Latest,
    /// From 1 for the first, from −1 backwards for the last.
    Number(i64),
    /// The nearest one to a time.
    At(Time),
}

/// How far from the time asked for a record may be (minutes).
const NEAR: i64 = 90;

/// `latest`, a number, or a time.
pub fn choice(text: &str) -> Result<Choice, String> {
    let text = text.trim();
    if text == "latest" {
        return Ok(Choice::Latest);
    }
    match (text.parse::<i64>(), text.parse::<Time>()) {
        (Ok(number), _) if number != 0 => Ok(Choice::Number(number)),
        (_, Ok(time)) => Ok(Choice::At(time)),
        _ => Err(format!(
            "expected latest, a number from 1 (-1: the last), or a time such as 2019-02-06T00:40, got \"{text}\""
        )),
    }
}

/// The record of a buoy that is meant. Whatever is missing in it is a warning.
pub fn record(buoy: &Buoy, file: &Path, choice: Choice, talk: &mut Talk) -> Result<Record, Failure> {
    let count = buoy.count();
    let (first, last) = (buoy.time(0), buoy.time(count - 1));
    let wrong = |expected: String, got: String| {
        Failure::Work(format!("{}: expected {expected}, got {got}; --list shows what there is", file.display()))
    };
    let index = match choice {
        Choice::Latest => count - 1,
        Choice::Number(number) => {
            let index = if number > 0 { number - 1 } else { number.saturating_add(count as i64) };
            usize::try_from(index)
                .ok()
                .filter(|index| *index < count)
                .ok_or_else(|| wrong(format!("a record from 1 to {count} (or -{count} to -1)"), number.to_string()))?
        }
        Choice::At(time) => {
            let index = buoy.nearest(time);
            let found = buoy.time(index);
            let off = (found.minutes() - time.minutes()).abs();
            if off > NEAR {
                let expected =
                    format!("a time with a record (they run from {first} to {last}, the nearest is of {found})");
                return Err(wrong(expected, time.to_string()));
            }
            if off > 0 {
                talk.note(format!("{}: no record of {time}: the one of {found} is taken", file.display()));
            }
            index
        }
    };
    let record = buoy.record(index)?;
    for warning in buoy.warnings().iter().chain(&record.notes) {
        talk.warn(warning);
    }
    Ok(record)
}

/// The sea state of a buoy's record.
pub fn of_record(record: Record) -> SeaState {
    let wind = probable_wind(&record.measured);
    SeaState { trains: vec![Train::Measured(record.measured)], wind, ..SeaState::CALM }
}

/// A sea state as typed. One that its water is too shallow for is taken, with a warning.
pub fn read(spec: &str, talk: &mut Talk) -> Result<SeaState, Failure> {
    let state = read_any(spec, talk)?;
    let (height, most) = (state.significant_height(), 0.78 * state.depth);
    if height > most {
        let (height, depth) = (tidy(height, 1), tidy(state.depth, 1));
        talk.warn(format!(
            "--sea {spec}: waves of {height} m in {depth} m of water would have broken; model=tma has those that are left"
        ));
    }
    Ok(state)
}

fn read_any(spec: &str, talk: &mut Talk) -> Result<SeaState, Failure> {
    let wrong = |problem: String| Failure::Usage(format!("--sea {spec}: {problem}; correct it"));
    let (mut file, mut chosen, mut rest) = (None, None, Vec::new());
    for word in spec.split(',').map(str::trim) {
        match word.split_once('=') {
            Some(("buoy", name)) if file.is_none() => file = Some(name),
            Some(("buoy", _)) => return Err(wrong("expected one buoy, got several".into())),
            Some(("record", text)) => chosen = Some(choice(text).map_err(wrong)?),
            _ => rest.push(word),
        }
    }
    let Some(file) = file else {
        if chosen.is_some() {
            return Err(wrong("expected buoy=FILE beside record, got none".into()));
        }
        return spec.parse().map_err(|error: littoral::waves::spec::SpecError| wrong(error.to_string()));
    };
    let beside = ["wind", "from", "swell", "depth", "seed"];
    if let Some(word) = rest.iter().find(|word| !beside.contains(&word.split('=').next().unwrap_or(""))) {
        return Err(wrong(format!("expected {} beside buoy, got `{word}`", beside.join(", "))));
    }
    let windy = rest.iter().any(|word| word.starts_with("wind="));
    if !windy && rest.iter().any(|word| word.starts_with("from=")) {
        return Err(wrong("expected wind=SPEED beside from (waves come from where the buoy says), got none".into()));
    }
    // Read without the buoy, for the words beside it; the sea that its wind would raise is left out.
    let line = if rest.is_empty() { "calm".to_owned() } else { rest.join(",") };
    let mut state: SeaState =
        line.parse().map_err(|error: littoral::waves::spec::SpecError| wrong(error.to_string()))?;
    if state.wind.speed > 0.0 && windy {
        state.trains.remove(0);
    }
    let file = Path::new(file);
    let buoy = Buoy::open(file)?;
    let measured = of_record(record(&buoy, file, chosen.unwrap_or(Choice::Latest), talk)?);
    if !windy {
        state.wind = measured.wind;
        let wind = tidy(state.wind.speed, 1);
        talk.note(format!(
            "wind by the buoy's short waves: {wind} m/s from {:.0}°",
            bearing_from_heading(state.wind.heading)
        ));
    }
    state.trains.splice(0..0, measured.trains);
    Ok(state)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_are_chosen_by_word_number_or_time() {
        assert_eq!(choice("latest"), Ok(Choice::Latest));
        assert_eq!(choice(" -1"), Ok(Choice::Number(-1)));
        assert!(matches!(choice("2019-02-06T00:40"), Ok(Choice::At(_))));
        for wrong in ["0", "", "last", "2019-02-31"] {
            assert!(choice(wrong).is_err_and(|e| e.contains("latest")), "{wrong}");
        }
    }

    #[test]
    fn a_buoy_takes_some_words_beside_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("bw2019.txt");
        std::fs::write(&file, "#YY MM DD hh mm .1000 .2000\n2019 02 06 00 40 1.0 2.0\n").expect("written");
        let name = file.display();
        let mut talk = Talk::new(true);
        let state =
            read(&format!("buoy={name},wind=7,from=90,swell=2@12/300,seed=5,depth=30"), &mut talk).expect("fine");
        assert_eq!((state.trains.len(), state.seed, state.depth, state.wind.speed), (2, 5, 30.0, 7.0));
        assert!(matches!(state.trains[0], Train::Measured(_)));
        assert_eq!(read(&format!("buoy={name},record=1"), &mut talk).expect("fine").trains.len(), 1);
        for (rest, words) in [
            (",hs=2,tp=8", "got `hs=2`"),
            (",from=30", "wind=SPEED"),
            (",record=x", "latest"),
            (",buoy=b", "several"),
            (",record=2", "a record from 1 to 1"),
            (",record=2020-01-01", "2019-02-06T00:40Z"),
        ] {
            match read(&format!("buoy={name}{rest}"), &mut talk) {
                Err(Failure::Usage(message) | Failure::Work(message)) => assert!(message.contains(words), "{message}"),
                other => panic!("{rest}: {other:?}"),
            }
        }
        assert!(matches!(read("record=1,wind=5", &mut talk), Err(Failure::Usage(_))));
    }
}

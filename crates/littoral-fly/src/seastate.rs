//! Single numbers of a sea's state as it is typed: `beaufort=4,from=225`.

/// The number of a key, if the text has one.
pub fn number(text: &str, key: &str) -> Option<f64> {
    text.split(',').find_map(|part| part.split_once('=').filter(|(name, _)| name.trim() == key)?.1.trim().parse().ok())
}

/// The text with another number of a key; at its end if it had none.
pub fn with(text: &str, key: &str, value: f64) -> String {
    let is = |part: &str| part.split_once('=').is_some_and(|(name, _)| name.trim() == key);
    let mut parts: Vec<String> = text.split(',').map(str::trim).filter(|p| !p.is_empty()).map(str::to_owned).collect();
    let changed = format!("{key}={value}");
    match parts.iter_mut().find(|part| is(part)) {
        Some(part) => *part = changed,
        None => parts.push(changed),
    }
    parts.join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_and_changed_and_the_rest_stays() {
        let text = "wind=3, from=200,swell=2.5@13/240";
        assert_eq!((number(text, "wind"), number(text, "from"), number(text, "swell")), (Some(3.0), Some(200.0), None));
        assert_eq!(with(text, "from", 90.0), "wind=3,from=90,swell=2.5@13/240");
        assert_eq!(with("beaufort=4", "from", 12.5), "beaufort=4,from=12.5");
        assert_eq!(with("", "wind", 7.0), "wind=7");
        let parsed = with(text, "wind", 11.0).parse::<littoral::waves::SeaState>();
        assert!(parsed.is_ok(), "{parsed:?}");
    }
}

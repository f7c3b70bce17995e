//! Spectra, spreading and dispersion against values that other people's packages computed (`../shared/reference/waves.json`,
//! where it is there).

use littoral::waves::{Spectrum, Spreading, StillWater};
use serde_json::Value;

const REFERENCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/reference/waves.json");

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|n| n.as_f64().expect("a number")).collect()
}

/// Largest relative difference where the reference is not negligible beside its largest value.
fn worst(ours: impl Fn(f64) -> f64, at: &Value, theirs: &Value) -> f64 {
    let (at, theirs) = (numbers(at), numbers(theirs));
    let largest = theirs.iter().copied().fold(0.0, f64::max);
    let differences =
        at.iter().zip(&theirs).filter(|(_, y)| **y > 1e-6 * largest).map(|(x, y)| (ours(*x) / y - 1.0).abs());
    differences.fold(0.0, f64::max)
}

#[test]
fn spectra_spreadings_and_wave_numbers_agree_with_other_packages() {
    let Ok(text) = std::fs::read_to_string(REFERENCE) else {
        println!("{REFERENCE} is absent: nothing compared");
        return;
    };
    let reference: Value = serde_json::from_str(&text).expect("the reference is JSON");
    let mut compared = std::collections::BTreeMap::<String, (usize, f64)>::new();
    for block in reference["blocks"].as_array().expect("blocks") {
        let kind = block["kind"].as_str().expect("a kind");
        let number = |key: &str| block[key].as_f64().unwrap_or_else(|| panic!("{kind} lacks {key}"));
        let spectrum = match kind {
            "pm_alpha_U10" => Spectrum::pierson_moskowitz(number("U10")).expect("in range"),
            "pm_Hs_Tp" => Spectrum::of_height_and_period(number("Hs"), number("Tp"), 1.0).expect("in range"),
            "jonswap_Hs_Tp" => {
                let (hs, tp) = (number("Hs"), number("Tp"));
                let gamma = block["gamma"].as_f64().unwrap_or_else(|| Spectrum::usual_gamma(hs, tp));
                Spectrum::of_height_and_period(hs, tp, gamma).expect("in range")
            }
            "jonswap_scaled_to_Hs_on_this_grid" => {
                let raw =
                    Spectrum::of_height_and_period(number("Hs"), number("Tp"), number("gamma")).expect("in range");
                // Theirs is scaled on its own coarse grid of frequencies, by the trapezoidal rule and a tail of f⁻⁵ beyond.
                let f = numbers(&block["f"]);
                let sum: f64 =
                    f.windows(2).map(|w| 0.5 * (raw.density(w[0]) + raw.density(w[1])) * (w[1] - w[0])).sum();
                let last = f[f.len() - 1];
                let sum = sum + 0.25 * last * raw.density(last);
                Spectrum { alpha: raw.alpha * number("Hs").powi(2) / 16.0 / sum, ..raw }
            }
            "jonswap_alpha" | "tma" => {
                let depth = block["depth"].as_f64().unwrap_or(f64::INFINITY);
                Spectrum { alpha: 0.0081, peak: number("fp"), gamma: 3.3, depth }
            }
            _ => {
                let difference = other(kind, block);
                if let Some(difference) = difference {
                    let entry = compared.entry(kind.to_owned()).or_default();
                    *entry = (entry.0 + 1, entry.1.max(difference));
                }
                continue;
            }
        };
        let difference = worst(|f| spectrum.density(f), &block["f"], &block["S"]);
        let entry = compared.entry(kind.to_owned()).or_default();
        *entry = (entry.0 + 1, entry.1.max(difference));
    }
    for (kind, (blocks, difference)) in &compared {
        println!("{kind}: {blocks} blocks, greatest relative difference {difference:.1e}");
        // The package that computed `tma` takes an approximate wave number (Chen and Thomson) inside.
        let tolerance = match kind.as_str() {
            "dispersion_gravity" => 1e-6,
            "tma" => 1.5e-3,
            _ => 1e-3,
        };
        assert!(*difference < tolerance, "{kind}: {difference}");
    }
    assert!(compared.len() >= 9, "{compared:?}");
}

fn other(kind: &str, block: &Value) -> Option<f64> {
    let number = |key: &str| block[key].as_f64().unwrap_or_else(|| panic!("{kind} lacks {key}"));
    match kind {
        "dispersion_gravity" => {
            let rows = block["rows"].as_array().expect("rows");
            let difference = |row: &Value| {
                let water = StillWater {
                    depth: row["h"].as_f64().expect("a depth"),
                    gravity: number("g"),
                    surface_tension: 0.0,
                };
                let k = water.wavenumber(row["omega"].as_f64().expect("a frequency"));
                (k / row["k_mhkit"].as_f64().expect("a wave number") - 1.0).abs()
            };
            Some(rows.iter().map(difference).fold(0.0, f64::max))
        }
        "spreading_cos2s_half_angle" | "spreading_cos2s_full_angle" => {
            let s = number("s");
            let spreading = match kind {
                "spreading_cos2s_half_angle" => Spreading::HalfAngle { s },
                _ => Spreading::FullAngle { s },
            };
            Some(worst(|angle| spreading.density(1.0, angle), &block["theta"], &block["D"]))
        }
        "spreading_cartwright_deg" => {
            let spreading = Spreading::of_width(number("dspr_deg").to_radians()).expect("a width");
            let mean = number("dm_deg");
            let ours = |degrees: f64| spreading.density(1.0, (degrees - mean).to_radians()) * 1f64.to_radians();
            Some(worst(ours, &block["dir_deg"], &block["D_per_deg"]))
        }
        "regular_wave_profile" if block["model"] == "Airy" => {
            let water = StillWater { depth: number("depth"), gravity: 9.81, surface_tension: 0.0 };
            let k = std::f64::consts::TAU / number("length");
            Some((water.angular_frequency(k) / number("omega") - 1.0).abs())
        }
        _ => None,
    }
}

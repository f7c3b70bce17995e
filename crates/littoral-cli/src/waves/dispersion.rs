//! `littoral waves dispersion`: how long and fast a wave is.

use super::digits;
use crate::input;
use crate::talk::{Failure, Talk};
use littoral::waves::{STANDARD_GRAVITY, SURFACE_TENSION, StillWater};
use serde::Serialize;
use std::f64::consts::{PI, TAU};

/// How long and how fast a wave is: the exact dispersion relation.
///
/// ω² = (g k + τ k³) tanh(k h), solved to the last digits at any depth. Give one of --omega, --period, --frequency or --wavelength, and the
/// depth of the water; deep water is taken without one. --tension adds the surface tension, which quickens ripples shorter than some 7 cm.
#[derive(clap::Args)]
#[command(
    group(clap::ArgGroup::new("wave").required(true)),
    after_help = "Examples:
  littoral waves dispersion --omega 0.785 --depth 10
  littoral waves dispersion --period 12                     a swell on the open ocean
  littoral waves dispersion --period 12 --depth 5           and before the beach
  littoral waves dispersion --wavelength 100 --depth 20     from a chart to a period
  littoral waves dispersion --wavelength 0.02 --tension     a ripple
  littoral waves dispersion --omega 1.2 --depth 8 --g 9.81 --json

JSON: k (rad/m), wavelength (m), phase_speed and group_speed (m/s), omega (rad/s), period (s),
frequency (Hz), depth (m; null: deep), kh, regime (shallow: kh < π/10; deep: kh > π), g, tension."
)]
pub struct Dispersion {
    /// Angular frequency (rad/s)
    #[arg(long, value_name = "W", group = "wave", value_parser = omega)]
    omega: Option<f64>,
    /// Period (s)
    #[arg(long, value_name = "T", group = "wave", value_parser = period)]
    period: Option<f64>,
    /// Frequency (Hz)
    #[arg(long, value_name = "F", group = "wave", value_parser = frequency)]
    frequency: Option<f64>,
    /// Length from crest to crest (m)
    #[arg(long, value_name = "L", group = "wave", value_parser = wavelength)]
    wavelength: Option<f64>,
    /// Depth of the water (m), or `deep`
    #[arg(long, value_name = "D", value_parser = depth, default_value = "deep")]
    depth: f64,
    /// Gravity (m/s²)
    #[arg(long, value_name = "G", value_parser = gravity, default_value_t = STANDARD_GRAVITY)]
    g: f64,
    /// Surface tension over density (m³/s²); without a number that of clean sea water [default: none]
    #[arg(long, value_name = "TENSION", value_parser = tension, num_args = 0..=1, default_missing_value = "7.16e-5")]
    tension: Option<f64>,
}

fn omega(text: &str) -> Result<f64, String> {
    input::within(text, 1e-6, 1e4, "an angular frequency from 1e-6 to 1e4 rad/s")
}

fn period(text: &str) -> Result<f64, String> {
    input::within(text, 1e-3, 1e6, "a period from 0.001 to 1e6 s")
}

fn frequency(text: &str) -> Result<f64, String> {
    input::within(text, 1e-6, 1e3, "a frequency from 1e-6 to 1000 Hz")
}

fn wavelength(text: &str) -> Result<f64, String> {
    input::within(text, 1e-6, 1e9, "a length from 1e-6 to 1e9 m")
}

fn depth(text: &str) -> Result<f64, String> {
    match text.trim() {
        "deep" | "inf" => Ok(f64::INFINITY),
        text => input::within(text, 1e-6, 1e6, "a depth from 1e-6 to 1e6 m, or deep"),
    }
}

fn gravity(text: &str) -> Result<f64, String> {
    input::within(text, 1e-3, 1e4, "a gravity from 0.001 to 1e4 m/s²")
}

fn tension(text: &str) -> Result<f64, String> {
    input::within(text, 0.0, 1.0, "a surface tension over density from 0 to 1 m³/s²")
}

#[derive(Serialize)]
struct Answer {
    k: f64,
    wavelength: f64,
    phase_speed: f64,
    group_speed: f64,
    omega: f64,
    period: f64,
    frequency: f64,
    depth: Option<f64>,
    kh: Option<f64>,
    regime: &'static str,
    g: f64,
    tension: f64,
}

impl Dispersion {
    /// Runs the command.
    pub fn run(self, talk: &mut Talk) -> Result<(), Failure> {
        let tension = self.tension.unwrap_or(0.0);
        let water = StillWater { depth: self.depth, gravity: self.g, surface_tension: tension };
        let water = water.checked().map_err(|error| Failure::Usage(format!("{error}; correct the command line")))?;
        let (omega, k) = match self.wavelength {
            Some(length) => (water.angular_frequency(TAU / length), TAU / length),
            None => {
                let other = self.period.map(|t| TAU / t).or(self.frequency.map(|f| TAU * f));
                let omega = self.omega.or(other).unwrap_or(1.0); // the group is required
                (omega, water.wavenumber(omega))
            }
        };
        let kh = k * self.depth;
        let answer = Answer {
            k,
            wavelength: TAU / k,
            phase_speed: water.phase_speed(k),
            group_speed: water.group_speed(k),
            omega,
            period: TAU / omega,
            frequency: omega / TAU,
            depth: self.depth.is_finite().then_some(self.depth),
            kh: kh.is_finite().then_some(kh),
            regime: if kh > PI {
                "deep"
            } else if kh < 0.1 * PI {
                "shallow"
            } else {
                "intermediate"
            },
            g: self.g,
            tension,
        };
        let numbers = [answer.k, answer.wavelength, answer.phase_speed, answer.group_speed, omega];
        if numbers.iter().any(|n| !(n.is_finite() && *n > 0.0)) {
            let problem = "expected a wave that numbers can hold, got one beyond them; choose a longer or shorter one";
            return Err(Failure::Work(problem.into()));
        }
        if tension == 0.0 && answer.wavelength < 0.07 {
            // Lamb § 267: at 7 cm tension adds 3 % to the speed.
            talk.warn(format!(
                "waves of {} m feel the surface tension, which is left out: add --tension ({SURFACE_TENSION:e} m³/s² for sea water)",
                digits(answer.wavelength, 3)
            ));
        }
        if talk.json() { talk.print_json(answer) } else { talk.print(answer.told()) }
    }
}

impl Answer {
    fn told(&self) -> String {
        let d = |number: f64| digits(number, 6);
        let depth = self.depth.map_or("deep water".into(), |depth| format!("{} m of water", digits(depth, 6)));
        let relative = match self.kh {
            Some(kh) => {
                format!("relative depth kh   {} ({}: shallow below 0.314, deep above 3.14)\n", d(kh), self.regime)
            }
            None => String::new(),
        };
        format!(
            "angular frequency   {} rad/s (period {} s, {} Hz) over {depth}\n\
             wave number k       {} rad/m\n\
             wavelength          {} m\n\
             phase speed         {} m/s\n\
             group speed         {} m/s ({:.3} of the phase speed)\n\
             {relative}",
            d(self.omega),
            d(self.period),
            d(self.frequency),
            d(self.k),
            d(self.wavelength),
            d(self.phase_speed),
            d(self.group_speed),
            self.group_speed / self.phase_speed,
        )
    }
}

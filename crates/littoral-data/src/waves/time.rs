//! Times of records: to the minute, UTC.

use std::fmt;
use std::str::FromStr;

/// A minute (UTC). Ordered; reads and writes as `2019-02-06T00:40Z`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Time {
    /// Year, 1900 to 2200.
    pub year: u16,
    /// Month, from 1.
    pub month: u8,
    /// Day, from 1.
    pub day: u8,
    /// Hour, 0 to 23.
    pub hour: u8,
    /// Minute, 0 to 59.
    pub minute: u8,
}

impl Time {
    /// A time of five numbers; `None` if there is no such. Years of two digits are of the last century from 70 on.
    pub fn new([year, month, day, hour, minute]: [u32; 5]) -> Option<Time> {
        let year = match year {
            70..=99 => 1900 + year,
            0..70 => 2000 + year,
            _ => year,
        };
        let leap = year.is_multiple_of(4) && !year.is_multiple_of(100) || year.is_multiple_of(400);
        let days = match month {
            2 => 28 + u32::from(leap),
            4 | 6 | 9 | 11 => 30,
            1..=12 => 31,
            _ => return None,
        };
        let fine = (1900..=2200).contains(&year) && (1..=days).contains(&day) && hour < 24 && minute < 60;
        fine.then_some(Time {
            year: year as u16,
            month: month as u8,
            day: day as u8,
            hour: hour as u8,
            minute: minute as u8,
        })
    }

    /// Minutes since some beginning, for differences.
    pub fn minutes(&self) -> i64 {
        // Days of the civil calendar with years that begin in March (H. Hinnant, "chrono-compatible low-level date algorithms").
        let (year, month) = match self.month {
            1 | 2 => (i64::from(self.year) - 1, i64::from(self.month) + 9),
            month => (i64::from(self.year), i64::from(month) - 3),
        };
        let days = 365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + i64::from(self.day);
        (24 * days + i64::from(self.hour)) * 60 + i64::from(self.minute)
    }
}

impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Time { year, month, day, hour, minute } = self;
        write!(f, "{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}Z")
    }
}

impl FromStr for Time {
    type Err = String;

    /// `2019-02-06T00:40Z`; a space may stand for `T`, the time of day (then 00:00) and the `Z` may be left out.
    fn from_str(text: &str) -> Result<Time, String> {
        let wrong = || format!("expected a time (UTC) such as 2019-02-06T00:40, got \"{text}\"");
        let plain = text.trim().trim_end_matches(['Z', 'z']);
        let (date, time) = plain.split_once(['T', 't', ' ']).unwrap_or((plain, "00:00"));
        let mut numbers = [0; 5];
        let words = date.splitn(3, '-').chain(time.splitn(3, ':').take(2));
        let mut count = 0;
        for (number, word) in numbers.iter_mut().zip(words) {
            let digits = word.len() <= 4 && word.bytes().all(|b| b.is_ascii_digit());
            *number = word.parse().ok().filter(|_| digits).ok_or_else(wrong)?;
            count += 1;
        }
        if count != 5 || date.find('-') != Some(4) {
            return Err(wrong());
        }
        Time::new(numbers).ok_or_else(wrong)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_read_as_they_write_and_count_minutes() {
        for text in ["2019-02-06T00:40Z", "2020-02-29T23:59Z", "1999-12-31T00:00Z"] {
            assert_eq!(text.parse::<Time>().expect(text).to_string(), text);
        }
        let at = |text: &str| text.parse::<Time>().expect(text).minutes();
        assert_eq!(at("2020-03-01 00:00") - at("2020-02-28T23:59"), 24 * 60 + 1);
        assert_eq!(at("2001-01-01") - at("2000-01-01"), 366 * 24 * 60);
        assert_eq!(at("2101-01-01") - at("2001-01-01"), 36_524 * 24 * 60);
        for wrong in [
            "",
            "2019",
            "2019-13-01",
            "2019-02-30",
            "2019-02-06T24:00",
            "19-02-06T00:40",
            "2019-02-06T1",
            "a-b-c",
            "2019-2-6T+1:+2",
        ] {
            assert!(wrong.parse::<Time>().is_err_and(|e| e.contains("2019-02-06T00:40")), "{wrong}");
        }
        assert_eq!(Time::new([98, 1, 2, 3, 0]).map(|t| t.year), Some(1998));
    }
}

use super::*;
use proptest::prelude::*;

const DENSITIES: &str = "#YY  MM DD hh mm Sep_Freq  < spec_1 (freq_1) spec_2 (freq_2) spec_3 (freq_3) ... >
2020 06 08 03 50 0.225 0.000 (0.050) 1.500 (0.100) 0.500 (0.150) 0.100 (0.200)
2020 06 08 02 50 9.999 0.000 (0.050) 999.0 (0.100) 0.500 (0.150) 0.200 (0.200)
";

fn pairs(kind: &str, values: [&str; 4]) -> String {
    let [a, b, c, d] = values;
    format!(
        "#YY  MM DD hh mm {kind}_1 (freq_1) {kind}_2 (freq_2) ... >\r\n2020 06 08 03 50 {a} (0.050) {b} (0.100) {c} (0.150) {d} (0.200) \r\n"
    )
}

fn files(parts: &[(&str, &str)]) -> Vec<(PathBuf, Vec<u8>)> {
    parts.iter().map(|(name, text)| (PathBuf::from(name), text.as_bytes().to_vec())).collect()
}

fn buoy(parts: &[(&str, &str)]) -> Buoy {
    Buoy::from_memory(files(parts)).unwrap_or_else(|e| panic!("{e}"))
}

fn error(parts: &[(&str, &str)]) -> String {
    let opened = Buoy::from_memory(files(parts));
    match opened.and_then(|buoy| (0..buoy.count()).map(|i| buoy.record(i)).collect::<Result<Vec<_>, _>>()) {
        Err(error) => error.to_string(),
        Ok(records) => panic!("read {} records", records.len()),
    }
}

#[test]
fn real_time_files_become_bands() {
    let directions = [
        ("b.swdir", pairs("alpha1", ["999.0", "270.0", "180.0", "90.0"])),
        ("b.swdir2", pairs("alpha2", ["999.0", "270.0", "999.0", "90.0"])),
        ("b.swr1", pairs("r1", ["999.00", "0.80", "0.60", "0.50"])),
        ("b.swr2", pairs("r2", ["999.00", "0.50", "0.30", "0.00"])),
    ];
    let mut parts = vec![("b.data_spec", DENSITIES)];
    parts.extend(directions.iter().map(|(name, text)| (*name, text.as_str())));
    let buoy = buoy(&parts);
    assert_eq!((buoy.count(), buoy.warnings().len()), (2, 0));
    assert_eq!([buoy.time(0), buoy.time(1)].map(|t| t.to_string()), ["2020-06-08T02:50Z", "2020-06-08T03:50Z"]);
    let latest = buoy.record(1).expect("fine");
    assert!(latest.notes.is_empty(), "{:?}", latest.notes);
    let bands = latest.measured.bands();
    assert_eq!(
        bands.iter().map(|b| (b.frequency, b.density)).collect::<Vec<_>>(),
        [(0.05, 0.0), (0.1, 1.5), (0.15, 0.5), (0.2, 0.1)]
    );
    let close = |a: [f64; 2], b: [f64; 2]| (0..2).all(|i| (a[i] - b[i]).abs() < 1e-12);
    assert!(close(bands[0].first, [0.0; 2]) && close(bands[0].second, [0.0; 2]), "missing: all round");
    assert!(close(bands[1].first, [0.8, 0.0]), "from the west: towards x");
    assert!(close(bands[1].second, [0.5, 0.0]));
    assert!(close(bands[2].first, [0.0, 0.6]), "from the south: towards y");
    // cos²ˢ with r₁ = 0.6 has s = 1.5 and r₂ = 1.5 · 0.5 / (2.5 · 3.5), twice the angle.
    assert!(close(bands[2].second, [-0.75 / 8.75, 0.0]), "{:?}", bands[2]);
    assert!(close(bands[3].first, [-0.5, 0.0]), "from the east: towards −x");
    // The earlier record has no directions, and one frequency no density.
    let earlier = buoy.record(0).expect("fine");
    assert_eq!(earlier.measured.bands().len(), 3);
    let notes = earlier.notes.join("\n");
    assert!(notes.contains("no record of 2020-06-08T02:50Z") && notes.contains("1 of 4 frequencies"), "{notes}");
    assert!(notes.contains("100 % of the energy has no direction"), "{notes}");
}

const YEAR: &str = "#YY  MM DD hh mm  .1000  .2000  .3000\n2019 02 06 00 40   1.00   2.00   0.50\n2019 02 06 01 40   1.00   2.50   0.50\n";

#[test]
fn historical_files_become_bands_with_r_in_hundredths_or_not() {
    for (r1, expected) in [("   90     60     30", 0.9), (" 0.90   0.60   0.30", 0.9), ("    1     80     70", 0.01)] {
        let row =
            |values: &str| YEAR.replace("1.00   2.00   0.50", values).lines().take(2).collect::<Vec<_>>().join("\n");
        let parts = [
            ("x/41010w2019.txt", YEAR.to_owned()),
            ("x/41010d2019.txt", row("270 270 270")),
            ("x/41010i2019.txt", row("270 270 270")),
            ("x/41010j2019.txt", row(r1)),
            ("x/41010k2019.txt", row("20 20 20")),
        ];
        let buoy = buoy(&parts.each_ref().map(|(name, text)| (*name, text.as_str())));
        assert!(buoy.warnings().is_empty());
        let first = buoy.record(0).expect("fine").measured.bands()[0].first;
        assert!((first[0] - expected).abs() < 1e-12, "{r1}: {first:?}");
    }
    // Before 2005 there are no minutes, before 1999 years have two digits, and headers have no mark.
    let old = buoy(&[("41010w1998.txt", "YY MM DD hh  .0300  .0400\n98 01 01 13  1.5  2.5\n")]);
    assert_eq!(old.time(0).to_string(), "1998-01-01T13:00Z");
    assert!(old.warnings()[0].contains("all round"));
    let newer = buoy(&[("41010w2005.txt", "YYYY MM DD hh mm  .0300  .0400\n2005 01 01 13 30 1.5  2.5\n")]);
    assert_eq!(newer.time(0).to_string(), "2005-01-01T13:30Z");
}

#[test]
fn names_lead_to_one_another() {
    let names = |file: &str| companions_of(file).unwrap_or_else(|| panic!("{file}"));
    assert!(names("a/b/41010.swdir").contains(&"a/b/41010.data_spec".into()));
    assert!(names("41010w2019part.txt.gz").contains(&"41010k2019part.txt".into()));
    assert!(names("historical/swden/41010w2019.txt.gz").contains(&"historical/swr1/41010j2019.txt.gz".into()));
    assert!(names("46w01w2005.txt").contains(&"46w01d2005.txt".into()));
    assert!(companions_of("waves.txt").is_none() && companions_of("日本.txt").is_none());
}

fn companions_of(file: &str) -> Option<Vec<PathBuf>> {
    ndbc::companions(Path::new(file)).map(|(_, names)| names.concat())
}

#[test]
fn broken_files_name_file_line_field_and_range() {
    let spoilt = |from: &str, to: &str| error(&[("b.data_spec", &DENSITIES.replacen(from, to, 1))]);
    let cases = [
        (
            spoilt("1.500", "-1.5"),
            "b.data_spec: line 2: expected a value of energy density from 0 to 100000 m²/Hz (999: missing) at 0.1 Hz, got -1.5; correct or remove the line",
        ),
        (spoilt("1.500", "NaN"), "line 2: expected a value of energy density, got \"NaN\""),
        (spoilt("1.500", "1,5"), "line 2: expected a value of energy density, got \"1,5\""),
        (
            spoilt("(0.150)", "(0.050)"),
            "line 2: expected frequencies (Hz) rising from above 0 to at most 10, got \"0.050\"",
        ),
        (spoilt("(0.200)", "(0.2"), "cut off"),
        (spoilt("(0.100)", ""), "one value before each frequency"),
        (
            spoilt("2020 06 08 03", "2020 06 31 03"),
            "line 2: expected year, month, day, hour and minute of a record, got \"2020 06 31 03 50\"",
        ),
        (
            spoilt("0.500 (0.150) 0.200 (0.200)", ""),
            "line 3: expected densities at 2 frequencies or more, got densities at 1; choose another record",
        ),
        (error(&[("b.data_spec", "")]), "empty"),
        (
            error(&[("b.data_spec", DENSITIES.lines().next().expect("a line"))]),
            "expected records below the header, got none",
        ),
        (error(&[("b.txt", "x y z\n1 2 3\n")]), "line 1: expected the header of NDBC's spectra"),
        (error(&[("b.spec", "#YY  MM DD hh mm WVHT  SwH\n")]), "summary"),
        (error(&[("b.swdir", &pairs("alpha1", ["1"; 4]))]), "file of energy densities beside it"),
        (error(&[("bw2019.txt", &YEAR.replace("2.00", ""))]), "line 2: expected 3 values of energy density, got 2"),
        (error(&[("bw2019.txt", &YEAR.replace("2.00", "2 2"))]), "line 2: expected 3 values of energy density, got 4"),
        (error(&[("bw2019.txt", &YEAR.replace(".3000", ".2000"))]), "line 1: expected frequencies (Hz) rising"),
        (error(&[("bw2019.txt", YEAR), ("cw2019.txt", YEAR)]), "leave one out"),
        (
            error(&[
                ("b.data_spec", DENSITIES),
                ("b.swdir", &pairs("alpha1", ["400"; 4])),
                ("b.swr1", &pairs("r1", ["0.5"; 4])),
            ]),
            "b.swdir: line 2: expected a value of mean direction (alpha1) from 0 to 360 degrees (999: missing) at 0.05 Hz, got 400",
        ),
    ];
    for (got, expected) in cases {
        assert!(got.contains(expected), "{got}\nlacks {expected}");
    }
}

#[test]
fn nearest_records_are_found() {
    let buoy = buoy(&[("b.data_spec", DENSITIES)]);
    let near = |text: &str| buoy.nearest(text.parse().expect(text));
    assert_eq!(
        [near("2019-01-01"), near("2020-06-08T03:19"), near("2020-06-08T03:21"), near("2030-01-01")],
        [0, 0, 1, 1]
    );
}

#[test]
fn packed_bombs_stop() {
    use std::io::Write;
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    packer.write_all(YEAR.as_bytes()).expect("memory");
    let mut packed = packer.finish().expect("memory");
    let read = |bytes: &[u8]| Buoy::from_memory(vec![("bw2019.txt.gz".into(), bytes.to_vec())]).map(|b| b.count());
    assert_eq!(read(&packed).expect("fine"), 2);
    packed.truncate(packed.len() / 2);
    assert!(read(&packed).expect_err("cut").to_string().contains("it may be cut off"));
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    for _ in 0..66 {
        packer.write_all(&[b' '; 1 << 20]).expect("memory");
    }
    assert!(read(&packer.finish().expect("memory")).expect_err("long").to_string().contains("at most 64 MiB"));
}

#[test]
fn winds_are_told_from_the_range_of_balance() {
    use littoral::waves::Spectrum;
    for speed in [5.0, 10.0, 20.0] {
        let sea = Spectrum::pierson_moskowitz(speed).expect("a wind");
        let band = |i: i32| {
            let frequency = 0.02 + 0.01 * f64::from(i);
            Band { frequency, density: sea.density(frequency), first: [0.0, 0.7], second: [0.0; 2] }
        };
        let wind = probable_wind(&Measured::new((0..80).map(band).collect()).expect("bands"));
        assert!((wind.speed / speed - 1.0).abs() < 0.25, "{} for {speed}", wind.speed);
        assert!((wind.heading - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    }
    let flat = Measured::new(
        [0.1, 0.2].map(|f| Band { frequency: f, density: 0.0, first: [0.0; 2], second: [0.0; 2] }).to_vec(),
    );
    assert_eq!(probable_wind(&flat.expect("bands")).speed, 0.0);
}

/// Heights of the summary that NDBC made of the same records.
#[test]
fn real_buoys_have_the_heights_that_ndbc_says() {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/waves"));
    let Ok(summary) = std::fs::read_to_string(folder.join("41010.spec")) else {
        println!("../shared/data is absent: no real buoys are read");
        return;
    };
    let height = |record: &Record| {
        let part = |pair: &[Band]| 0.5 * (pair[0].density + pair[1].density) * (pair[1].frequency - pair[0].frequency);
        4.0 * record.measured.bands().windows(2).map(part).sum::<f64>().sqrt()
    };
    let buoy = Buoy::open(&folder.join("41010.swr2")).expect("real time");
    assert_eq!((buoy.count(), buoy.warnings().len()), (149, 0));
    let mut compared = 0;
    for line in summary.lines().filter(|line| !line.starts_with('#')) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let time: Time = format!("{}-{}-{} {}:50", words[0], words[1], words[2], words[3]).parse().expect(line);
        let Ok(expected) = words[5].parse::<f64>() else { continue };
        let index = buoy.nearest(time);
        if buoy.time(index) == time {
            let record = buoy.record(index).expect(line);
            assert!((height(&record) - expected).abs() < 0.05 + 0.03 * expected, "{line}: {}", height(&record));
            assert!(record.notes.is_empty(), "{:?}", record.notes);
            compared += 1;
        }
    }
    assert!(compared > 140, "only {compared} records compared");
    let year = Buoy::open(&folder.join("41010w2019part.txt.gz")).expect("historical");
    assert_eq!((year.count(), year.warnings().len()), (99, 0));
    for index in 0..year.count() {
        let record = year.record(index).expect("fine");
        assert_eq!(record.measured.bands().len(), 47);
        assert!((0.3..8.0).contains(&height(&record)), "{}: {}", record.time, height(&record));
        let strongest = record.measured.bands().iter().map(|b| b.first[0].hypot(b.first[1])).fold(0.0, f64::max);
        assert!((0.5..=1.0).contains(&strongest), "hundredths are told: {strongest}");
    }
}

proptest! {
    #[test]
    fn what_is_written_is_read(values in prop::collection::vec((0.0..500.0f64, 0.0..360.0f64, 0.0..360.0f64, 0.0..1.0f64, 0.0..1.0f64), 2..30)) {
        let line = |value: &dyn Fn(usize) -> f64| -> String {
            (0..values.len()).map(|i| format!(" {} ({:.3})", value(i), 0.02 + 0.01 * i as f64)).collect()
        };
        let file = |kind: &str, sep: &str, value: &dyn Fn(usize) -> f64| {
            format!("#YY MM DD hh mm {sep} {kind}_1 (freq_1)\n2020 01 01 00 00 {}{}\n", if sep.is_empty() { "" } else { "0.2" }, line(value))
        };
        let parts = [
            ("b.data_spec", file("spec", "Sep_Freq", &|i| values[i].0)),
            ("b.swdir", file("alpha1", "", &|i| values[i].1)),
            ("b.swdir2", file("alpha2", "", &|i| values[i].2)),
            ("b.swr1", file("r1", "", &|i| values[i].3)),
            ("b.swr2", file("r2", "", &|i| values[i].4)),
        ];
        let record = buoy(&parts.each_ref().map(|(name, text)| (*name, text.as_str()))).record(0).expect("fine");
        for (band, v) in record.measured.bands().iter().zip(&values) {
            let expected = Band::of_bearings(band.frequency, v.0, v.1.to_radians(), v.2.to_radians(), v.3, v.4);
            prop_assert_eq!(*band, expected);
        }
    }
}

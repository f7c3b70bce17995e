#![no_main]

use littoral_data::waves::{Buoy, probable_wind};

const NAMES: [&str; 5] = ["b.data_spec", "b.swdir", "b.swdir2", "b.swr1", "b.swr2"];

// Up to five files of a buoy, split at zero bytes; and the whole as one, which may be packed.
libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let parts = data.splitn(5, |&b| b == 0).zip(NAMES).map(|(part, name)| (name.into(), part.to_vec())).collect();
    check(Buoy::from_memory(parts));
    check(Buoy::from_memory(vec![("bw2019.txt.gz".into(), data.to_vec())]));
});

fn check(opened: Result<Buoy, littoral_data::Error>) {
    let buoy = match opened {
        Ok(buoy) => buoy,
        Err(error) => {
            assert!(error.to_string().contains("expected"));
            return;
        }
    };
    assert!(buoy.count() > 0 && (1..buoy.count()).all(|i| buoy.time(i - 1) < buoy.time(i)));
    for index in 0..buoy.count().min(16) {
        assert_eq!(buoy.nearest(buoy.time(index)), index);
        let Ok(record) = buoy.record(index) else { continue };
        let wind = probable_wind(&record.measured);
        assert!((0.0..=60.0).contains(&wind.speed) && wind.heading.is_finite());
        for band in record.measured.bands() {
            assert!(band.density >= 0.0 && band.first.iter().chain(&band.second).all(|c| c.abs() <= 1.0));
            let density = record.measured.directions(band.frequency).density(1.0);
            assert!(density >= 0.0 && density.is_finite());
        }
    }
}

//! Processor time, for benchmarks on machines that others use, too.

/// Median processor time (s) of some runs.
pub fn median(runs: usize, mut work: impl FnMut()) -> f64 {
    let mut seconds: Vec<f64> = (0..runs)
        .map(|_| {
            let begin = processor_time();
            work();
            processor_time() - begin
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    seconds[runs / 2]
}

/// Processor time of this process (s), so that others on the machine count less.
#[cfg(target_os = "linux")]
pub fn processor_time() -> f64 {
    unsafe extern "C" {
        fn clock_gettime(clock: i32, time: *mut [i64; 2]) -> i32;
    }
    let mut time = [0; 2];
    // SAFETY: two 64-bit numbers are what 64-bit Linux writes there; clock 2 is the process's.
    unsafe { clock_gettime(2, &mut time) };
    time[0] as f64 + 1e-9 * time[1] as f64
}

/// Time by the wall (s), where nothing better is at hand.
#[cfg(not(target_os = "linux"))]
pub fn processor_time() -> f64 {
    static BEGIN: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    BEGIN.get_or_init(std::time::Instant::now).elapsed().as_secs_f64()
}

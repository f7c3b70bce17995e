//! What a height file is and holds, and how long that takes: `cargo run --release --example survey FILE [MOST_SAMPLES]`.
//! With a number, the file is also loaded into at most so many samples.

use littoral_data::{LoadOptions, load_from, open, survey};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args_os().skip(1);
    let Some(file) = arguments.next().map(std::path::PathBuf::from) else {
        return Err("expected a file".into());
    };
    let most = arguments.next().and_then(|number| number.to_str()?.parse::<usize>().ok());
    let start = Instant::now();
    let mut source = open(&file)?;
    println!("{:#?}", source.info());
    println!("levels {:?}, opened in {:.3} s", source.levels(), start.elapsed().as_secs_f64());
    let start = Instant::now();
    if let Some(most_samples) = most {
        let dem = load_from(&mut *source, &file, LoadOptions { most_samples }, &|_| {})?;
        let (raster, seconds) = (&dem.raster, start.elapsed().as_secs_f64());
        println!("{} × {} samples, spacing {} m", raster.columns(), raster.rows(), raster.spacing());
        println!("{:?}, {} void, loaded in {seconds:.3} s", raster.range(), raster.voids().count());
        println!("{:#?}", dem.info.warnings);
    } else {
        println!("{:?}", survey(&mut *source, &|_| {})?);
        println!("surveyed in {:.3} s; {:#?}", start.elapsed().as_secs_f64(), source.info().warnings);
    }
    Ok(())
}

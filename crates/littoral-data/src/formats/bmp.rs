//! BMP: greys, or a palette of greys, are metres as they stand, in steps of 1 m. Pictures in colour are refused.

use super::{Input, check_fits, georeference_beside, info};
use crate::voids::VoidRule;
use crate::{Error, MemorySource, Source};
use image::ImageDecoder;
use image::codecs::bmp::BmpDecoder;

/// Whether the file begins as a BMP does: its mark, and a header of one of the known lengths.
pub fn sniff(head: &[u8]) -> bool {
    head.starts_with(b"BM")
        && head.get(14..18).is_some_and(|size| matches!(size, [12 | 40 | 52 | 56 | 64 | 108 | 124, 0, 0, 0]))
}

/// Opens such a file.
///
/// # Errors
/// If the header is broken or promises more than the file holds, or the picture is in colour.
pub fn open(mut input: Input) -> Result<Box<dyn Source>, Error> {
    let name = input.name.clone();
    let fails =
        |e: image::ImageError| Error::content(&name, format!("expected a BMP, got a broken one ({e}); save it anew"));
    let decoder = BmpDecoder::new(input.from_start()?).map_err(fails)?;
    let (columns, rows) = decoder.dimensions();
    let [columns, rows] = [columns as usize, rows as usize];
    let colour = decoder.color_type();
    let channels = colour.channel_count() as usize;
    drop(decoder);
    // Run lengths pack at most 255 pixels into two bytes; a single bit may be a pixel.
    check_fits(&input, columns, rows, input.length().saturating_mul(128))?;
    let decoder = BmpDecoder::new(input.from_start()?).map_err(fails)?;
    let total = usize::try_from(decoder.total_bytes()).ok().filter(|&n| n == columns * rows * channels);
    let total = total.ok_or_else(|| Error::content(&name, format!("expected 8 bits a channel, got {colour:?}")))?;
    let mut bytes = vec![0; total];
    decoder.read_image(&mut bytes).map_err(fails)?;
    let grey = |pixel: &[u8]| channels < 3 || (pixel[0] == pixel[1] && pixel[1] == pixel[2]);
    if !bytes.chunks_exact(channels).all(grey) {
        return Err(
            input.error("expected greys as heights, got a picture in colour; pictures are draped, not read as land")
        );
    }
    let mut info = info("BMP", columns, rows);
    info.georeference = georeference_beside(&input, columns, rows, &["bpw", "bmpw", "wld"]);
    info.step = 1.0;
    info.warnings.push("grey values of a BMP are taken as metres: land comes in steps of 1 m".into());
    let heights = bytes.chunks_exact(channels).map(|p| VoidRule::default().height(f64::from(p[0]))).collect();
    Ok(Box::new(MemorySource::new(info, heights)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use littoral::field::Window;

    fn bmp(pixels: &[u8], colour: image::ExtendedColorType) -> Vec<u8> {
        let mut bytes = Vec::new();
        image::codecs::bmp::BmpEncoder::new(&mut bytes).encode(pixels, 3, 2, colour).expect("encodes");
        bytes
    }

    #[test]
    fn greys_are_metres_from_the_north() {
        let bytes = bmp(&[1, 2, 3, 4, 5, 255], image::ExtendedColorType::L8);
        assert!(sniff(&bytes));
        let mut source = open(Input::memory("t.bmp", bytes.clone())).expect("opens");
        let all = source.read(0, Window { column: 0, row: 0, columns: 3, rows: 2 }).expect("reads");
        assert_eq!(all, [1.0, 2.0, 3.0, 4.0, 5.0, 255.0]);
        for (at, value) in [(21, 0x7F), (25, 0x7F), (25, 0x80), (24, 0xFF)] {
            let mut hostile = bytes.clone();
            hostile[at] = value;
            assert!(open(Input::memory("t.bmp", hostile)).is_err());
        }
    }

    #[test]
    fn colours_are_refused() {
        let mut pixels = [100; 18];
        pixels[5] = 7;
        let error = open(Input::memory("t.bmp", bmp(&pixels, image::ExtendedColorType::Rgb8))).err().expect("colour");
        assert!(error.to_string().contains("draped"));
    }
}

//! PNG pictures, 8 or 16 bits a channel.

use super::whole;
use crate::Error;
use std::io::{self, Write};
use std::path::Path;

/// Pixels of a PNG, row by row from the top.
#[derive(Clone, Copy, Debug)]
pub enum PngPixels<'a> {
    /// sRGB colours, 8 bits a channel.
    Rgb8(&'a [[u8; 3]]),
    /// sRGB colours, 16 bits a channel.
    Rgb16(&'a [[u16; 3]]),
    /// Greys, 8 bits.
    Grey8(&'a [u8]),
    /// Greys, 16 bits: heights, for instance.
    Grey16(&'a [u16]),
}

/// Writes a PNG of `width` × `height` pixels. `notes` become text chunks (keyword, text): keywords are Latin-1 of 1 to 79
/// characters, such as `Software` or `Description`.
///
/// # Errors
/// If the system refuses.
///
/// # Panics
/// If there are not `width × height` pixels.
pub fn png(file: &Path, width: u32, height: u32, pixels: PngPixels<'_>, notes: &[(&str, String)]) -> Result<(), Error> {
    whole(file, |sink| encode(sink, width, height, pixels, notes))
}

fn encode(
    sink: impl Write,
    width: u32,
    height: u32,
    pixels: PngPixels<'_>,
    notes: &[(&str, String)],
) -> io::Result<()> {
    let (colour, depth, bytes, count) = match pixels {
        PngPixels::Rgb8(p) => (png::ColorType::Rgb, png::BitDepth::Eight, p.as_flattened().to_vec(), p.len()),
        PngPixels::Grey8(p) => (png::ColorType::Grayscale, png::BitDepth::Eight, p.to_vec(), p.len()),
        PngPixels::Rgb16(p) => {
            let bytes = p.as_flattened().iter().flat_map(|v| v.to_be_bytes()).collect();
            (png::ColorType::Rgb, png::BitDepth::Sixteen, bytes, p.len())
        }
        PngPixels::Grey16(p) => {
            let bytes = p.iter().flat_map(|v| v.to_be_bytes()).collect();
            (png::ColorType::Grayscale, png::BitDepth::Sixteen, bytes, p.len())
        }
    };
    assert_eq!(count, width as usize * height as usize, "expected {width} × {height} pixels, got {count}");
    let mut encoder = png::Encoder::new(sink, width, height);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    // Pictures are noisy: a thirtieth of the time for a tenth more bytes. Heights and the like compress well, if one tries.
    let picture = matches!(pixels, PngPixels::Rgb8(_));
    encoder.set_compression(if picture { png::Compression::Fast } else { png::Compression::Balanced });
    if colour == png::ColorType::Rgb {
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    }
    for (keyword, text) in notes {
        encoder.add_itxt_chunk((*keyword).to_owned(), text.clone()).map_err(io::Error::other)?;
    }
    let mut writer = encoder.write_header().map_err(io::Error::other)?;
    writer.write_image_data(&bytes).map_err(io::Error::other)?;
    writer.finish().map_err(io::Error::other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_come_back() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("p.png");
        let colours: Vec<[u16; 3]> = (0..6).map(|i| [i * 9000, 65_535 - i, 258]).collect();
        png(&file, 3, 2, PngPixels::Rgb16(&colours), &[("Description", "a sea — wide".into())]).expect("written");
        let mut reader = png::Decoder::new(io::BufReader::new(std::fs::File::open(&file).expect("there")))
            .read_info()
            .expect("a PNG");
        let mut bytes = vec![0; reader.output_buffer_size().expect("small")];
        reader.next_frame(&mut bytes).expect("a picture");
        let back: Vec<u16> = bytes.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect();
        assert_eq!(back, colours.as_flattened());
        assert_eq!(reader.info().utf8_text[0].get_text().expect("text"), "a sea — wide");
        let greys: Vec<u8> = (0..35).collect();
        png(&file, 7, 5, PngPixels::Grey8(&greys), &[]).expect("written");
        let mut reader = png::Decoder::new(io::BufReader::new(std::fs::File::open(&file).expect("there")))
            .read_info()
            .expect("a PNG");
        let mut bytes = vec![0; 35];
        reader.next_frame(&mut bytes).expect("a picture");
        assert_eq!(bytes, greys);
    }
}

//! PNG: greys of 8 and 16 bits are metres as they stand; colours are read as Terrarium or Terrain-RGB (see
//! [`tiles`]). Gamma, colour profiles and the "transparent grey" chunk are left aside: they belong to
//! pictures, and programs write zero, the sea, as transparent. Pixels of an alpha channel that is empty are void.

use super::tiles::{self, Encoding, TRANSPARENT};
use super::{Input, georeference_beside, info, pam::Notes};
use crate::{Error, MemorySource, Source};
use png::{BitDepth, ColorType, Decoder, Limits, Transformations};

/// Deflate cannot make more than so many bytes of one (258 bytes of a match from 2 bits).
const DEFLATE_MOST: u64 = 1032;

/// The most the decoder may hold besides the rows it hands out; a row of the widest raster in 16-bit colour takes 128 MiB.
const DECODER_BYTES: usize = 256 << 20;

/// Whether the file begins as every PNG does.
pub fn sniff(head: &[u8]) -> bool {
    head.starts_with(b"\x89PNG\r\n\x1a\n")
}

/// Opens such a file. Rows missing at the end become void, with a warning.
///
/// # Errors
/// If the header is broken or promises more than the file can hold, nothing can be decoded, or it is a picture.
pub fn open(mut input: Input) -> Result<Box<dyn Source>, Error> {
    let pixels = decode(&mut input)?;
    let Pixels { columns, rows, .. } = pixels;
    let mut info = info("PNG", columns, rows);
    info.georeference = georeference_beside(&input, columns, rows, &["pgw", "pngw", "wld"]);
    info.warnings = pixels.warnings;
    let notes = Notes::beside(&input);
    info.warnings.extend(notes.warnings);
    match as_asked(pixels.values, input.encoding).map_err(|problem| input.error(problem))? {
        Values::Grey { values, bits } => {
            info.vertical_metres = notes.band.metres(&mut info.warnings).unwrap_or(1.0);
            // Alpha was turned into NaN; no value of 0 … 65 535 is a sentinel.
            let rule = notes.band.rule(info.vertical_metres);
            info.nodata = rule.nodata;
            info.step = (rule.scale * rule.metres).abs();
            info.warnings.push(match bits {
                16 => "grey values of a PNG are taken as metres".into(),
                bits => format!(
                    "grey values of a PNG are taken as metres: with {bits} bits a sample, land comes in steps of 1 m"
                ),
            });
            let heights = values.into_iter().map(|v| rule.height(f64::from(v))).collect();
            Ok(Box::new(MemorySource::new(info, heights)))
        }
        Values::Colour(colours) => {
            let code = match input.encoding {
                Some(Encoding::Code(code)) => code,
                _ => tiles::detect(&colours, columns)
                    .map_err(|problem| input.error(format!("{problem}; if they are heights, choose the encoding")))?,
            };
            info.format = match code {
                tiles::Code::Terrarium => "PNG (Terrarium)",
                tiles::Code::TerrainRgb => "PNG (Terrain-RGB)",
            };
            info.step = code.step();
            if input.encoding.is_none() {
                info.warnings
                    .push(format!("colours are read as heights in the {code:?} code, told by what they decode to"));
            }
            let heights = colours.into_iter().map(|pixel| code.height(pixel)).collect();
            Ok(Box::new(MemorySource::new(info, heights)))
        }
    }
}

struct Pixels {
    columns: usize,
    rows: usize,
    values: Values,
    warnings: Vec<String>,
}

enum Values {
    /// NaN where transparent.
    Grey { values: Vec<f32>, bits: u8 },
    /// `0xRRGGBB`, with [`TRANSPARENT`].
    Colour(Vec<u32>),
}

/// The same pixels in the encoding that was asked for; if none was, colours that are all grey are greys, saved by a program
/// that knows nothing else.
fn as_asked(values: Values, encoding: Option<Encoding>) -> Result<Values, String> {
    match (values, encoding) {
        (Values::Grey { .. }, Some(Encoding::Code(code))) => {
            Err(format!("expected colours, to be read as {code:?}, got greys; leave out the encoding"))
        }
        (Values::Colour(colours), None | Some(Encoding::Grey)) => {
            let opaque = || colours.iter().filter(|&p| p & TRANSPARENT == 0);
            let all_grey = opaque().all(|p| p & 0xFF == p >> 8 & 0xFF && p & 0xFF == p >> 16 & 0xFF);
            if all_grey && opaque().next().is_some() {
                let grey = |p: u32| if p & TRANSPARENT != 0 { f32::NAN } else { (p & 0xFF) as f32 };
                return Ok(Values::Grey { values: colours.into_iter().map(grey).collect(), bits: 8 });
            }
            match encoding {
                None => Ok(Values::Colour(colours)),
                Some(_) => Err("expected red, green and blue to be equal, as in greys, got colours".into()),
            }
        }
        (values, _) => Ok(values),
    }
}

fn decode(input: &mut Input) -> Result<Pixels, Error> {
    let name = input.name.clone();
    let fails =
        |e: png::DecodingError| Error::content(&name, format!("expected a PNG, got a broken one ({e}); save it anew"));
    let length = input.length();
    let mut decoder = Decoder::new_with_limits(input.from_start()?, Limits { bytes: DECODER_BYTES });
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    // Palettes become colours, small greys bytes; `EXPAND` also adds an alpha channel where there is a transparent colour.
    decoder.set_transformations(Transformations::EXPAND);
    let header = decoder.read_header_info().map_err(fails)?;
    let [columns, rows] = [header.width as usize, header.height as usize];
    let source_colour = header.color_type;
    let bits = header.bit_depth as u8;
    // The header is believed once the file could hold so many pixels, and before anything of their size is allocated.
    let bits_per_pixel = header.bits_per_pixel() as u64;
    let most_pixels = length.saturating_mul(DEFLATE_MOST).saturating_add(1024).saturating_mul(8) / bits_per_pixel;
    let samples = super::check_size_fits(&name, length, columns, rows, most_pixels)?;
    let mut reader = decoder.read_info().map_err(fails)?;
    let (colour, depth) = reader.output_color_type();
    let channels = colour.samples();
    let bytes = if depth == BitDepth::Sixteen { 2 } else { 1 };
    if channels >= 3 && bytes == 2 {
        return Err(Error::content(
            &name,
            "expected 8-bit colours that code heights, or 16-bit greys, got 16-bit colours",
        ));
    }

    // A transparent colour among greys is most often zero, the sea: only a channel of its own says what is void.
    let has_alpha = matches!(source_colour, ColorType::GrayscaleAlpha | ColorType::Rgba | ColorType::Indexed);
    let alpha = |pixel: &[u8]| has_alpha && channels % 2 == 0 && pixel[(channels - 1) * bytes] < 128;
    let mut values = match channels {
        1 | 2 => Values::Grey { values: Vec::with_capacity(samples), bits },
        _ => Values::Colour(Vec::with_capacity(samples)),
    };
    let mut append = |row: &[u8]| match &mut values {
        Values::Grey { values, .. } => {
            values.extend(row.chunks_exact(channels * bytes).map(|pixel| match alpha(pixel) {
                true => f32::NAN,
                false if bytes == 2 => f32::from(u16::from_be_bytes([pixel[0], pixel[1]])),
                false => f32::from(pixel[0]),
            }))
        }
        Values::Colour(colours) => colours.extend(row.chunks_exact(channels).map(|pixel| {
            let rgb = u32::from_be_bytes([0, pixel[0], pixel[1], pixel[2]]);
            if alpha(pixel) { rgb | TRANSPARENT } else { rgb }
        })),
    };

    let mut warnings = Vec::new();
    if reader.info().interlaced {
        let size = reader.output_buffer_size().ok_or_else(|| fails(png::DecodingError::LimitsExceeded))?;
        let mut buffer = vec![0; size];
        reader.next_frame(&mut buffer).map_err(fails)?;
        append(&buffer);
    } else {
        for row in 0..rows {
            match reader.next_row() {
                Ok(Some(data)) => append(data.data()),
                // What came before is sound: every row depends only on those above it.
                Err(e) if row > 0 => {
                    warnings.push(format!(
                        "expected {rows} rows, got {row} ({e}): the file is broken there, the rest is void"
                    ));
                    break;
                }
                Err(e) => return Err(fails(e)),
                Ok(None) => break,
            }
        }
    }
    match &mut values {
        Values::Grey { values, .. } => values.resize(samples, f32::NAN),
        Values::Colour(colours) => colours.resize(samples, TRANSPARENT),
    }
    Ok(Pixels { columns, rows, values, warnings })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Info;
    use littoral::field::Window;

    fn encode(columns: u32, rows: u32, colour: ColorType, depth: BitDepth, data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, columns, rows);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        let mut writer = encoder.write_header().expect("valid");
        writer.write_image_data(data).expect("valid");
        writer.finish().expect("valid");
        bytes
    }

    fn read(bytes: Vec<u8>) -> Result<(Info, Vec<f32>), Error> {
        let mut source = open(Input::memory("t.png", bytes))?;
        let info = source.info().clone();
        let window = Window { column: 0, row: 0, columns: info.columns, rows: info.rows };
        Ok((info, source.read(0, window)?))
    }

    #[test]
    fn greys_are_metres_and_alpha_is_void() {
        let data: Vec<u8> = [0u16, 0, 300, 65535, 8848, 65535].iter().flat_map(|v| v.to_be_bytes()).collect();
        let (info, heights) = read(encode(3, 1, ColorType::GrayscaleAlpha, BitDepth::Sixteen, &data)).expect("reads");
        assert!(heights[0].is_nan());
        assert_eq!(heights[1..], [300.0, 8848.0]);
        assert_eq!((info.columns, info.rows, info.step), (3, 1, 1.0));
        let (info, heights) =
            read(encode(2, 2, ColorType::Grayscale, BitDepth::Eight, &[0, 1, 2, 255])).expect("reads");
        assert_eq!(heights, [0.0, 1.0, 2.0, 255.0]);
        assert!(info.warnings.iter().any(|w| w.contains("8 bits")));
    }

    #[test]
    fn tiles_are_decoded() {
        let heights: Vec<f64> = (0..64 * 64).map(|i| 1500.0 + 1000.0 * (i as f64 * 0.01).sin()).collect();
        let colour = |h: &f64| ((h + 32768.0) * 256.0) as u32;
        let data: Vec<u8> = heights.iter().map(colour).flat_map(|c| c.to_be_bytes()[1..].to_vec()).collect();
        let (info, got) = read(encode(64, 64, ColorType::Rgb, BitDepth::Eight, &data)).expect("reads");
        assert_eq!(info.format, "PNG (Terrarium)");
        assert!(heights.iter().zip(got).all(|(h, g)| (h - f64::from(g)).abs() < 1.0 / 128.0));
    }

    #[test]
    fn an_encoding_that_is_chosen_is_not_doubted() {
        let read = |bytes, encoding| {
            let mut input = Input::memory("t.png", bytes);
            input.encoding = Some(encoding);
            let mut source = crate::formats::open_input(input)?;
            let Info { columns, rows, .. } = *source.info();
            Ok::<_, Error>((source.info().clone(), source.read(0, Window { column: 0, row: 0, columns, rows })?))
        };
        let (terrarium, mapbox) = (Encoding::Code(tiles::Code::Terrarium), Encoding::Code(tiles::Code::TerrainRgb));
        // Colours that are all grey are greys, unless someone says otherwise. The last is transparent.
        let grey = || encode(3, 1, ColorType::Rgba, BitDepth::Eight, &[7, 7, 7, 255, 140, 140, 140, 255, 1, 2, 3, 0]);
        let (info, heights) = read(grey(), Encoding::Grey).expect("reads");
        assert_eq!((info.format, &heights[..2], heights[2].is_nan()), ("PNG", &[7.0, 140.0][..], true));
        let (_, heights) = read(grey(), terrarium).expect("reads");
        assert_eq!((heights[0].is_nan(), heights[1]), (true, 3212.0 + 35.0 / 64.0));
        let picture = encode(2, 1, ColorType::Rgb, BitDepth::Eight, &[250, 0, 0, 20, 7, 0]);
        assert!(
            open(Input::memory("t.png", picture)).err().expect("a picture").to_string().contains("choose the encoding")
        );
        // (1, 0, 0) is 6553.6 − 10 000 m in one code and far below the sea bed in the other.
        let colour = || encode(2, 1, ColorType::Rgb, BitDepth::Eight, &[1, 0, 0, 128, 1, 0]);
        let (info, heights) = read(colour(), mapbox).expect("reads");
        assert_eq!((info.format, heights[0], heights[1].is_nan()), ("PNG (Terrain-RGB)", -3446.4, true));
        let (info, heights) = read(colour(), terrarium).expect("reads");
        assert_eq!((info.format, heights[0].is_nan(), heights[1]), ("PNG (Terrarium)", true, 1.0));
        assert!(info.warnings.is_empty());
        assert!(read(colour(), Encoding::Grey).expect_err("colours").to_string().contains("got colours"));
        let greys = encode(2, 1, ColorType::Grayscale, BitDepth::Eight, &[1, 2]);
        assert!(read(greys, mapbox).expect_err("greys").to_string().contains("got greys"));
        assert!(read(b"ncols 2\n".to_vec(), mapbox).expect_err("text").to_string().contains("expected a PNG"));
    }

    #[test]
    fn notes_beside_say_what_greys_are() {
        let notes = "<PAMDataset><GeoTransform>9, 2, 0, 8, 0, -2</GeoTransform><PAMRasterBand band=\"1\"><NoDataValue>0\
            </NoDataValue><Scale>0.1</Scale><Offset>-10</Offset></PAMRasterBand></PAMDataset>";
        let bytes = encode(3, 1, ColorType::Grayscale, BitDepth::Eight, &[0, 100, 255]);
        let mut source = open(Input::memory("t.png", bytes).with_sidecar("aux.xml", notes.into())).expect("opens");
        let heights = source.read(0, Window { column: 0, row: 0, columns: 3, rows: 1 }).expect("reads");
        assert_eq!((heights[0].is_nan(), heights[1], heights[2]), (true, 0.0, 15.5));
        let info = source.info();
        assert_eq!((info.georeference.geotransform[0], info.nodata, info.step), (9.0, Some(0.0), 0.1));
    }

    #[test]
    fn broken_ones_are_partial_or_errors() {
        let noise: Vec<u8> = (0..128 * 128u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let bytes = encode(128, 128, ColorType::Grayscale, BitDepth::Eight, &noise);
        let (info, heights) = read(bytes[..bytes.len() / 2].to_vec()).expect("partial");
        assert!(info.warnings.iter().any(|w| w.contains("the rest is void")));
        assert!(heights[0].is_finite() && heights[128 * 128 - 1].is_nan());
        // Width and checksum of the header, in turn.
        let mut wrong = bytes.clone();
        wrong[29] ^= 1;
        assert!(read(wrong).is_err());
        assert!(read(bytes[..40].to_vec()).is_err());
        let huge = encode(1 << 16, 1, ColorType::Grayscale, BitDepth::Eight, &[0; 1 << 16]);
        assert!(read(huge).is_ok());
    }
}

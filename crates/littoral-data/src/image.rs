//! Pictures to drape over land: PNG, JPEG, BMP and TIFF, placed by a GeoTIFF's tags or a world file where there are any.
//!
//! The crate `image` decodes; sizes are held against the file's length before, so that a few bytes cannot ask for gigabytes.

use crate::formats::{Input, tiff};
use crate::{Error, Georeference, Info};
use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::path::Path;

/// A picture in sRGB, row by row from its first row.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Red, green and blue of each pixel; what was transparent is blended into [`BEHIND`].
    pub rgb: Vec<[u8; 3]>,
    /// Where the pixels lie, if the picture says so.
    pub georeference: Option<Georeference>,
    /// What was noticed. One sentence each.
    pub warnings: Vec<String>,
}

/// What shows through transparent pixels: a grey that is neither land nor sea.
pub const BEHIND: u8 = 128;

/// The most pixels of a picture: 20 000 × 13 000, three quarters of a gigabyte.
const MOST_PIXELS: u64 = 1 << 28;

/// No codec here packs more colour pixels into a byte than deflate: 1032 bytes, of which a pixel is three.
const MOST_PIXELS_A_BYTE: u64 = 344;

/// Opens a picture, told by its content.
///
/// # Errors
/// If it cannot be read, is of no known format or broken, or is larger than its file can hold or memory should.
pub fn open_image(file: &Path) -> Result<Image, Error> {
    image_from(Input::file(file)?)
}

/// Whether a file is a picture of something and no heights: colours that code none, of eight bits, or a JPEG of any kind.
pub fn is_picture(file: &Path) -> bool {
    let Ok(mut input) = Input::file(file) else { return false };
    let Some(format) = input.head(16).ok().and_then(|head| image::guess_format(&head).ok()) else { return false };
    let coloured = |input: &mut Input| {
        let reader = ImageReader::with_format(input.from_start().ok()?, format);
        Some(matches!(reader.into_decoder().ok()?.color_type(), ColorType::Rgb8 | ColorType::Rgba8))
    };
    match format {
        ImageFormat::Jpeg => true,
        ImageFormat::Bmp | ImageFormat::Tiff => coloured(&mut input) == Some(true),
        ImageFormat::Png => coloured(&mut input) == Some(true) && crate::open(file).is_err(),
        _ => false,
    }
}

/// Decodes an opened picture.
///
/// # Errors
/// As [`open_image`].
pub fn image_from(mut input: Input) -> Result<Image, Error> {
    let head = input.head(16)?;
    let format = match image::guess_format(&head) {
        Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Bmp | ImageFormat::Tiff)) => format,
        _ if head.is_empty() => return Err(input.error("expected a picture, got an empty file")),
        _ => {
            return Err(input.error("expected a PNG, JPEG, BMP or TIFF picture, got another format; convert it to PNG"));
        }
    };
    let name = input.name.clone();
    let fails = |e: image::ImageError| {
        let hint = if format == ImageFormat::Tiff { "`gdal_translate -of PNG` may rewrite it" } else { "save it anew" };
        Error::content(&name, format!("expected a sound {format:?} picture, got: {e}; {hint}"))
    };
    let length = input.length();
    let most_pixels = MOST_PIXELS.min(length.saturating_mul(MOST_PIXELS_A_BYTE).saturating_add(1 << 16));
    let mut reader = ImageReader::with_format(input.from_start()?, format);
    let mut limits = Limits::default();
    // Up to eight bytes a pixel while decoding; the decoder also keeps tables and rows.
    limits.max_alloc = Some(most_pixels * 8 + (16 << 20));
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(fails)?;
    let (columns, rows) = decoder.dimensions();
    let pixels = u64::from(columns) * u64::from(rows);
    if pixels == 0 || pixels > most_pixels {
        return Err(Error::content(
            &name,
            format!(
                "expected at most {MOST_PIXELS} pixels, and no more than {length} bytes can hold, got {columns} × {rows}; \
                 make it smaller or fetch it again"
            ),
        ));
    }
    let picture = DynamicImage::from_decoder(decoder).map_err(fails)?;
    let mut warnings = Vec::new();
    let rgb = over_grey(picture, &mut warnings);
    let [columns, rows] = [columns as usize, rows as usize];
    if rgb.len() != columns * rows {
        return Err(Error::content(&name, format!("expected {columns} × {rows} pixels, got {}", rgb.len())));
    }
    let georeference = place(input, format, [columns, rows], &mut warnings);
    Ok(Image { columns, rows, rgb, georeference, warnings })
}

/// Colours of eight bits without alpha.
fn over_grey(picture: DynamicImage, warnings: &mut Vec<String>) -> Vec<[u8; 3]> {
    if !picture.color().has_alpha() {
        return picture.into_rgb8().into_raw().as_chunks::<3>().0.to_vec();
    }
    let mut transparent = 0u64;
    let blend = |pixel: &[u8; 4]| {
        let alpha = u32::from(pixel[3]);
        transparent += u64::from(alpha < 128);
        [0, 1, 2].map(|c| ((u32::from(pixel[c]) * alpha + u32::from(BEHIND) * (255 - alpha) + 127) / 255) as u8)
    };
    let rgb = picture.into_rgba8().into_raw().as_chunks::<4>().0.iter().map(blend).collect();
    if transparent > 0 {
        warnings.push(format!("{transparent} pixels of the picture are transparent: they are shown grey"));
    }
    rgb
}

/// What a GeoTIFF's tags, a world file or a projection beside the picture say.
fn place(input: Input, format: ImageFormat, size: [usize; 2], warnings: &mut Vec<String>) -> Option<Georeference> {
    let extensions: &[&str] = match format {
        ImageFormat::Tiff => {
            return match tiff::open_input(input) {
                Ok(source) => {
                    let Info { georeference, columns, rows, .. } = source.info().clone();
                    ([columns, rows] == size && !georeference.y_south).then_some(georeference)
                }
                Err(e) => {
                    warnings.push(format!("where the picture lies could not be read ({e})"));
                    None
                }
            };
        }
        ImageFormat::Jpeg => &["jgw", "jpgw", "jpegw", "wld"],
        ImageFormat::Bmp => &["bpw", "bmpw", "wld"],
        _ => &["pgw", "pngw", "wld"],
    };
    let georeference = crate::formats::georeference_beside(&input, size[0], size[1], extensions);
    (!georeference.y_south).then_some(georeference)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::{jpeg::JpegEncoder, png::PngEncoder};
    use image::{ExtendedColorType, ImageEncoder};

    fn png(pixels: &[u8], columns: u32, rows: u32, colour: ExtendedColorType) -> Vec<u8> {
        let mut bytes = Vec::new();
        PngEncoder::new(&mut bytes).write_image(pixels, columns, rows, colour).expect("encodes");
        bytes
    }

    #[test]
    fn colours_greys_and_alpha() {
        let read = |bytes| image_from(Input::memory("t.png", bytes)).expect("reads");
        let colours = read(png(&[1, 2, 3, 4, 5, 6], 2, 1, ExtendedColorType::Rgb8));
        assert_eq!(colours.rgb, [[1, 2, 3], [4, 5, 6]]);
        assert_eq!((colours.columns, colours.rows, &colours.georeference), (2, 1, &None));
        let greys = read(png(&[9, 200], 1, 2, ExtendedColorType::L8));
        assert_eq!(greys.rgb, [[9; 3], [200; 3]]);
        let alpha = read(png(&[10, 20, 30, 255, 10, 20, 30, 0], 2, 1, ExtendedColorType::Rgba8));
        assert_eq!(alpha.rgb, [[10, 20, 30], [BEHIND; 3]]);
        assert!(alpha.warnings[0].starts_with("1 pixels"));
    }

    #[test]
    fn jpeg_with_a_world_file_is_placed() {
        let mut bytes = Vec::new();
        JpegEncoder::new_with_quality(&mut bytes, 95)
            .write_image(&[200; 16 * 8 * 3], 16, 8, ExtendedColorType::Rgb8)
            .expect("encodes");
        let input = Input::memory("t.jpg", bytes).with_sidecar("jgw", b"2\n0\n0\n-2\n101\n999\n".to_vec());
        let picture = image_from(input).expect("reads");
        assert!(picture.rgb.iter().flatten().all(|v| v.abs_diff(200) <= 2));
        let georeference = picture.georeference.expect("placed");
        assert_eq!(georeference.geotransform, [100.0, 2.0, 0.0, 1000.0, 0.0, -2.0]);
        assert_eq!(georeference.size, [16, 8]);
    }

    #[test]
    fn pictures_are_told_from_heights() {
        let folder = tempfile::tempdir().expect("a folder");
        let told = |name: &str, bytes: &[u8]| {
            let file = folder.path().join(name);
            std::fs::write(&file, bytes).expect("written");
            is_picture(&file)
        };
        let noise = |count: u32| (0..count).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect::<Vec<_>>();
        assert!(told("photo.png", &png(&noise(32 * 32 * 3), 32, 32, ExtendedColorType::Rgb8)));
        // Terrarium: 256 R + G + B / 256 − 32768.
        let hill = |i: u32| [128, (i % 32 + i / 32) as u8, 0];
        let terrarium: Vec<u8> = (0..32 * 32).flat_map(hill).collect();
        assert!(!told("tile.png", &png(&terrarium, 32, 32, ExtendedColorType::Rgb8)));
        assert!(!told("grey.png", &png(&noise(64), 8, 8, ExtendedColorType::L8)));
        let mut jpeg = Vec::new();
        JpegEncoder::new(&mut jpeg).write_image(&[7; 64], 8, 8, ExtendedColorType::L8).expect("encodes");
        assert!(told("photo.dat", &jpeg));
        let mut tiff = std::io::Cursor::new(Vec::new());
        let encoder = image::codecs::tiff::TiffEncoder::new(&mut tiff);
        encoder.write_image(&noise(8 * 8 * 3), 8, 8, ExtendedColorType::Rgb8).expect("encodes");
        assert!(told("ortho.tif", tiff.get_ref()));
        assert!(!told("dem.asc", b"ncols 2\n") && !told("empty", b"") && !is_picture(Path::new("not there")));
    }

    #[test]
    fn what_is_no_picture_or_too_large_is_refused() {
        let error = |bytes: Vec<u8>| image_from(Input::memory("t", bytes)).expect_err("must fail").to_string();
        assert!(error(Vec::new()).contains("empty"));
        assert!(error(b"hello, this is no picture".to_vec()).contains("another format"));
        let mut huge = png(&[0; 12], 4, 1, ExtendedColorType::Rgb8);
        assert!(error(huge[..40].to_vec()).contains("Png"));
        // Another size in the header; its checksum no longer fits either, but size or checksum, nothing is allocated.
        huge[18] = 0x7F;
        assert!(error(huge).contains("expected"));
    }
}

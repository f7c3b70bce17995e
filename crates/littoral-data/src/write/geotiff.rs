//! GeoTIFF grids: answers that lie exactly over the file that was asked.
//!
//! OGC 19-008r4, *OGC GeoTIFF Standard* 1.1, 2019; GDAL's `GDAL_NODATA` and `GDAL_METADATA` tags.

use super::{Sink, whole};
use crate::formats::{Input, pam::Notes};
use crate::{Crs, Error, Georeference, Registration};
use std::io;
use std::path::Path;
use tiff::encoder::colortype::{ColorType, Gray8, Gray32Float};
use tiff::encoder::{Compression, DeflateLevel, TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard, TiffValue};
use tiff::tags::{Predictor, Tag};

/// Samples of a grid, in the file's order (first row first).
#[derive(Clone, Copy, Debug)]
pub enum GridSamples<'a> {
    /// Bytes: masks and classes.
    U8(&'a [u8]),
    /// Floating-point numbers: heights and distances. NaN stands for void and is declared as no-data.
    F32(&'a [f32]),
}

/// GeoTIFF's keys, as another file stated them: carried over word by word, so that nothing of a coordinate system is lost
/// that this engine does not understand.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GeoTags {
    /// `GeoKeyDirectoryTag`: a header of four numbers, then four for each key.
    pub directory: Vec<u16>,
    /// `GeoDoubleParamsTag`.
    pub doubles: Vec<f64>,
    /// `GeoAsciiParamsTag`.
    pub ascii: String,
}

/// `GTRasterTypeGeoKey`, whose value 2 says that tie points are those of samples rather than of pixel corners.
const RASTER_TYPE: u16 = 1025;

impl GeoTags {
    /// Those of a TIFF file; `None` for any other file, for one without keys, and for one whose keys are overruled by an
    /// `.aux.xml` beside it.
    pub fn of_file(file: &Path) -> Option<GeoTags> {
        if Notes::beside(&Input::file(file).ok()?).crs.is_some() {
            return None;
        }
        let mut decoder = tiff::decoder::Decoder::new(std::io::BufReader::new(std::fs::File::open(file).ok()?)).ok()?;
        // Keys of a thousand coordinate systems are shorter than this; anything longer is broken.
        const LONGEST: usize = 1 << 16;
        let directory = decoder.get_tag_u16_vec(Tag::GeoKeyDirectoryTag).ok().filter(|d| d.len() < LONGEST)?;
        let doubles = decoder.get_tag_f64_vec(Tag::GeoDoubleParamsTag).ok().filter(|d| d.len() < LONGEST);
        let ascii = decoder.get_tag_ascii_string(Tag::GeoAsciiParamsTag).ok().filter(|d| d.len() < LONGEST);
        Some(GeoTags { directory, doubles: doubles.unwrap_or_default(), ascii: ascii.unwrap_or_default() })
    }

    /// The least that names a coordinate system by an EPSG code; nothing for one without.
    fn of(georeference: &Georeference) -> GeoTags {
        let code = |name: &str| name.strip_prefix("EPSG:").and_then(|code| code.parse::<u16>().ok());
        let raster_type = match georeference.registration {
            Registration::Area => 1,
            Registration::Point => 2,
        };
        let (model, key, code) = match &georeference.crs {
            Crs::Projected { name, .. } => (1, 3072, code(name)),
            Crs::Geographic { name } => (2, 2048, code(name)),
            Crs::Unknown => (0, 0, None),
        };
        let directory = match code {
            Some(code) => vec![1, 1, 0, 3, 1024, 0, 1, model, RASTER_TYPE, 0, 1, raster_type, key, 0, 1, code],
            None => vec![1, 1, 0, 1, RASTER_TYPE, 0, 1, raster_type],
        };
        GeoTags { directory, ..GeoTags::default() }
    }

    fn pixel_is_point(&self) -> bool {
        self.directory.chunks_exact(4).skip(1).any(|key| key[0] == RASTER_TYPE && key[1] == 0 && key[3] == 2)
    }
}

/// Writes a grid of `georeference.size` samples that lies where `georeference` says, compressed with Deflate. `tags` are
/// the keys of the file the grid was made from, if it was a GeoTIFF. `void` is the value declared as no-data in a grid of
/// bytes; `note` is kept as the picture's description.
///
/// # Errors
/// If the system refuses, or a side is longer than a TIFF can name.
///
/// # Panics
/// If the number of samples is not that of the size.
pub fn geotiff(
    file: &Path,
    georeference: &Georeference,
    tags: Option<&GeoTags>,
    samples: GridSamples<'_>,
    void: Option<u8>,
    note: &str,
) -> Result<(), Error> {
    let [columns, rows] = georeference.size;
    let (Ok(width), Ok(height)) = (u32::try_from(columns), u32::try_from(rows)) else {
        return Err(Error::content(
            file,
            format!("expected at most 2³² samples a side, got {columns} × {rows}; use a part"),
        ));
    };
    let (count, bytes) = match samples {
        GridSamples::U8(s) => (s.len(), s.len()),
        GridSamples::F32(s) => (s.len(), 4 * s.len()),
    };
    assert_eq!(count, columns * rows, "expected {columns} × {rows} samples, got {count}");
    let made;
    let tags = match tags {
        Some(tags) => tags,
        None => {
            made = GeoTags::of(georeference);
            &made
        }
    };
    let nodata = match samples {
        GridSamples::U8(_) => void.map(|v| v.to_string()),
        GridSamples::F32(_) => Some("nan".to_owned()),
    };
    let head = Head { width, height, georeference, tags, nodata, note };
    // Deflate may grow incompressible samples a little; offsets of a classic TIFF end at 4 GiB.
    let big = bytes as u64 > 4_000_000_000;
    whole(file, |sink| {
        let written = match (samples, big) {
            (GridSamples::U8(s), false) => head.write::<Gray8, TiffKindStandard>(sink, s),
            (GridSamples::U8(s), true) => head.write::<Gray8, TiffKindBig>(sink, s),
            (GridSamples::F32(s), false) => head.write::<Gray32Float, TiffKindStandard>(sink, s),
            (GridSamples::F32(s), true) => head.write::<Gray32Float, TiffKindBig>(sink, s),
        };
        written.map_err(|e| match e {
            tiff::TiffError::IoError(e) => e,
            e => io::Error::other(e),
        })
    })
}

struct Head<'a> {
    width: u32,
    height: u32,
    georeference: &'a Georeference,
    tags: &'a GeoTags,
    nodata: Option<String>,
    note: &'a str,
}

impl Head<'_> {
    fn write<C: ColorType, K: TiffKind>(&self, sink: &mut dyn Sink, samples: &[C::Inner]) -> tiff::TiffResult<()>
    where
        [C::Inner]: TiffValue,
    {
        // Bytes are masks: small in any case, and asked for quickly.
        let level = if size_of::<C::Inner>() == 1 { DeflateLevel::Fast } else { DeflateLevel::Balanced };
        let mut encoder: TiffEncoder<_, K> = TiffEncoder::new_generic(sink)?
            .with_compression(Compression::Deflate(level))
            .with_predictor(Predictor::None);
        let mut image = encoder.new_image::<C>(self.width, self.height)?;
        let tags = image.encoder();
        if !self.note.is_empty() {
            tags.write_tag(Tag::ImageDescription, self.note)?;
        }
        tags.write_tag(Tag::Software, "littoral")?;
        let g = self.georeference.geotransform;
        let half = if self.tags.pixel_is_point() { 0.5 } else { 0.0 };
        let (x, y) = (g[0] + half * (g[1] + g[2]), g[3] + half * (g[4] + g[5]));
        let north_up = g[2] == 0.0 && g[4] == 0.0 && g[1] > 0.0 && g[5] < 0.0;
        if north_up {
            tags.write_tag(Tag::ModelPixelScaleTag, &[g[1], -g[5], 0.0][..])?;
            tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, x, y, 0.0][..])?;
        } else if g != [0.0, 1.0, 0.0, 0.0, 0.0, 1.0] {
            // Rows of a matrix from (column, row, 0, 1) to (x, y, 0, 1).
            let matrix = [g[1], g[2], 0.0, x, g[4], g[5], 0.0, y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
            tags.write_tag(Tag::ModelTransformationTag, &matrix[..])?;
        }
        if !self.tags.directory.is_empty() {
            tags.write_tag(Tag::GeoKeyDirectoryTag, &self.tags.directory[..])?;
        }
        if !self.tags.doubles.is_empty() {
            tags.write_tag(Tag::GeoDoubleParamsTag, &self.tags.doubles[..])?;
        }
        if !self.tags.ascii.is_empty() {
            tags.write_tag(Tag::GeoAsciiParamsTag, self.tags.ascii.as_str())?;
        }
        if let Some(nodata) = &self.nodata {
            tags.write_tag(Tag::GdalNodata, nodata.as_str())?;
        }
        image.write_data(samples)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tiff::decoder::{Decoder, DecodingResult};

    fn grid(geotransform: [f64; 6], registration: Registration) -> Georeference {
        let crs = Crs::Projected { name: "EPSG:32610".into(), metres: 1.0, definition: None };
        Georeference { geotransform, registration, crs, size: [5, 3], y_south: false }
    }

    #[test]
    fn a_grid_comes_back_in_its_place() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("g.tif");
        let samples: Vec<u8> = (0..15).map(|i| if i % 2 == 0 { 255 } else { 0 }).collect();
        for (registration, corner) in [(Registration::Area, [500.0, 900.0]), (Registration::Point, [515.0, 885.0])] {
            let place = grid([500.0, 30.0, 0.0, 900.0, 0.0, -30.0], registration);
            geotiff(&file, &place, None, GridSamples::U8(&samples), Some(1), "seen from a hill").expect("written");
            let mut decoder = Decoder::new(std::fs::File::open(&file).expect("there")).expect("a TIFF");
            assert_eq!(decoder.dimensions().expect("a size"), (5, 3));
            assert_eq!(decoder.get_tag_f64_vec(Tag::ModelPixelScaleTag).expect("a scale"), [30.0, 30.0, 0.0]);
            let tie = decoder.get_tag_f64_vec(Tag::ModelTiepointTag).expect("a tie point");
            assert_eq!([tie[3], tie[4]], corner, "{registration:?}");
            let keys = decoder.get_tag_u16_vec(Tag::GeoKeyDirectoryTag).expect("keys");
            assert_eq!(keys[12..], [3072, 0, 1, 32610]);
            assert_eq!(decoder.get_tag_ascii_string(Tag::GdalNodata).expect("no-data"), "1");
            let DecodingResult::U8(back) = decoder.read_image().expect("samples") else { panic!("bytes expected") };
            assert_eq!(back, samples);
        }
    }

    #[test]
    fn rotated_grids_and_foreign_keys_are_carried_over() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("g.tif");
        let place = grid([500.0, 30.0, 5.0, 900.0, 5.0, -30.0], Registration::Area);
        let tags = GeoTags {
            directory: vec![1, 1, 0, 2, 1024, 0, 1, 32767, 3073, 34737, 7, 0],
            doubles: vec![298.25],
            ascii: "My own|".into(),
        };
        let samples: Vec<f32> = (0..15).map(|i| i as f32).collect();
        geotiff(&file, &place, Some(&tags), GridSamples::F32(&samples), None, "").expect("written");
        let mut decoder = Decoder::new(std::fs::File::open(&file).expect("there")).expect("a TIFF");
        let matrix = decoder.get_tag_f64_vec(Tag::ModelTransformationTag).expect("a matrix");
        assert_eq!(matrix[..8], [30.0, 5.0, 0.0, 500.0, 5.0, -30.0, 0.0, 900.0]);
        assert_eq!(decoder.get_tag_u16_vec(Tag::GeoKeyDirectoryTag).expect("keys"), tags.directory);
        assert_eq!(decoder.get_tag_f64_vec(Tag::GeoDoubleParamsTag).expect("doubles"), tags.doubles);
        assert_eq!(decoder.get_tag_ascii_string(Tag::GeoAsciiParamsTag).expect("text"), tags.ascii);
        assert_eq!(GeoTags::of_file(&file), Some(tags));
        let DecodingResult::F32(back) = decoder.read_image().expect("samples") else { panic!("floats expected") };
        assert_eq!(back, samples);
    }
}

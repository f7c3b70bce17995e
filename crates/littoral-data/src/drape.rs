//! A picture of the ground where it lies on a land.

use crate::{Crs, Error, Georeference, open_image};
use glam::{DAffine2, DMat2, DVec2, UVec2};
use littoral::field::Land;
use littoral::picture::{Drape, Texture};
use std::path::Path;

/// Opens a picture that is to be laid over `land`, where it says that it lies, or over all of the land if it says nothing. `place` has the land's coordinate
/// system, in which `crs_from_local` tells where its local metres are. Also what was noticed, one sentence each.
///
/// # Errors
/// If the picture cannot be opened ([`open_image`]), lies elsewhere, or in a system that the land's cannot be brought to.
pub fn open_drape(
    file: &Path,
    land: &Land,
    place: &Georeference,
    crs_from_local: DAffine2,
) -> Result<(Drape, Vec<String>), Error> {
    let image = open_image(file)?;
    let mut warnings = image.warnings;
    let size = UVec2::new(image.columns as u32, image.rows as u32);
    let texture = Texture::from_srgb(size, &image.rgb);
    // Shares of the land's sides, from its south-western corner.
    let unit_from_local = DAffine2::from_scale(1.0 / land.extent()) * DAffine2::from_translation(-land.origin());
    let Some(own) = &image.georeference else {
        warnings.push("the picture says not where it lies: laid over all of the land".into());
        let upright = DAffine2::from_scale_angle_translation(DVec2::new(1.0, -1.0), 0.0, DVec2::Y);
        return Ok((Drape { texture, uv_from_local: upright * unit_from_local }, warnings));
    };
    let uv_from_crs = DAffine2::from_scale(1.0 / size.as_dvec2())
        * DAffine2::from_translation(DVec2::splat(0.5))
        * own.crs_from_sample().inverse();
    // From the land's metres to the picture's coordinates: exact at three corners of the land, an affine map between.
    let corner = |share: DVec2| -> Result<DVec2, String> {
        let crs = crs_from_local.transform_point2(land.origin() + share * land.extent());
        let same = own.crs == place.crs || own.crs == Crs::Unknown;
        let there = if same { crs } else { own.crs_from_lonlat(place.lonlat_from_crs(crs)?)? };
        Ok(uv_from_crs.transform_point2(own.near(there)))
    };
    let corners = (|| Ok([corner(DVec2::ZERO)?, corner(DVec2::X)?, corner(DVec2::Y)?]))();
    let [origin, east, north] = corners.map_err(|problem: String| {
        Error::content(file, format!("{problem}; convert the picture to the land's system"))
    })?;
    let uv_from_unit = DAffine2::from_mat2_translation(DMat2::from_cols(east - origin, north - origin), origin);
    let shares = [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].map(|share| uv_from_unit.transform_point2(share));
    let (low, high) = (shares.into_iter().fold(shares[0], DVec2::min), shares.into_iter().fold(shares[0], DVec2::max));
    if high.min_element() < 0.0 || low.max_element() > 1.0 {
        let problem = "expected a picture that lies over the land, got one of another place; name another";
        return Err(Error::content(file, problem));
    }
    if low.min_element() < -0.01 || high.max_element() > 1.01 {
        warnings.push("the picture covers only a part of the land".into());
    }
    Ok((Drape { texture, uv_from_local: uv_from_unit * unit_from_local }, warnings))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
    use littoral::field::Raster;
    use std::fs::write;

    /// A land of 300 × 200 m whose south-western corner is at (1000, 5000) of its system, and a picture of 6 × 4 pixels of different colours.
    fn both(world: Option<&str>) -> Result<(Drape, Vec<String>), Error> {
        let folder = tempfile::tempdir().expect("a folder");
        let raster = Raster::new(4, 3, DVec2::splat(100.0), vec![1.0; 12]).expect("a raster");
        let file = folder.path().join("picture.png");
        let pixels: Vec<u8> = (0..24u8).flat_map(|i| [10 * i, 200 - i, 7]).collect();
        let mut bytes = Vec::new();
        PngEncoder::new(&mut bytes).write_image(&pixels, 6, 4, ExtendedColorType::Rgb8).expect("encodes");
        write(&file, bytes).expect("written");
        if let Some(world) = world {
            write(file.with_extension("pgw"), world).expect("written");
        }
        let crs_from_local = DAffine2::from_translation(DVec2::new(1000.0, 5000.0));
        open_drape(&file, &Land::new(raster), &Georeference::none(2, 2), crs_from_local)
    }

    #[test]
    fn a_picture_without_a_place_covers_all_of_the_land() {
        let (drape, warnings) = both(None).expect("laid");
        let uv = |x, y| drape.uv_from_local.transform_point2(DVec2::new(x, y));
        assert_eq!(
            (uv(0.0, 200.0), uv(300.0, 0.0), uv(150.0, 150.0)),
            (DVec2::ZERO, DVec2::ONE, DVec2::new(0.5, 0.25))
        );
        assert!(warnings[0].contains("says not where"), "{warnings:?}");
    }

    #[test]
    fn a_picture_with_a_place_lies_there() {
        // Pixels of 50 m, the middle of the north-western one at (1025, 5175): just over the land.
        let (drape, warnings) = both(Some("50\n0\n0\n-50\n1025\n5175")).expect("laid");
        let uv = |x, y| drape.uv_from_local.transform_point2(DVec2::new(x, y));
        assert!(uv(0.0, 200.0).length() < 1e-9 && (uv(300.0, 0.0) - DVec2::ONE).length() < 1e-9);
        assert_eq!(warnings, Vec::<String>::new());
        // Of 20 m it covers a part only.
        let (drape, warnings) = both(Some("20\n0\n0\n-20\n1010\n5190")).expect("laid");
        let there = drape.uv_from_local.transform_point2(DVec2::new(120.0, 120.0));
        assert!((there - DVec2::ONE).length() < 1e-9, "{there}");
        assert!(warnings[0].contains("part of the land"), "{warnings:?}");
        let elsewhere = both(Some("20\n0\n0\n-20\n9010\n5190")).expect_err("elsewhere").to_string();
        assert!(elsewhere.contains("picture.png: expected a picture that lies over the land"), "{elsewhere}");
    }
}

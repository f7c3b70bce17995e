//! What GDAL notes about a file beside it or within it: `land.tif.aux.xml` ("persistent auxiliary metadata"), and the XML in
//! a GeoTIFF's tag 42112. GDAL writes such a file wherever a format has no room for something, or was opened for reading.
//!
//! Based on: GDAL's documentation of its PAM and GTiff drivers; which of two statements is believed is GDAL 3.6's order.

use super::Input;
use crate::crs::metres_of_unit_name;
use crate::voids::VoidRule;
use crate::{Crs, Registration, VerticalDatum};
use roxmltree::{Document, Node};

/// What is said of a file, each as far as it is said.
#[derive(Debug, Default)]
pub(crate) struct Notes {
    /// Always of pixel corners.
    pub geotransform: Option<[f64; 6]>,
    pub registration: Option<Registration>,
    pub crs: Option<Crs>,
    pub vertical: Option<VerticalDatum>,
    pub band: BandNotes,
    pub warnings: Vec<String>,
}

/// What is said of the first band's heights.
#[derive(Debug, Default)]
pub(crate) struct BandNotes {
    pub nodata: Option<f64>,
    pub scale: Option<f64>,
    pub offset: Option<f64>,
    pub unit: Option<String>,
}

impl Notes {
    /// Those beside a file; nothing if there are none. What cannot be understood is left aside, with a warning.
    pub(crate) fn beside(input: &Input) -> Notes {
        let mut notes = Notes::default();
        let aside = |problem: String| format!("the notes in the .aux.xml beside the file are left aside: {problem}");
        let Some(text) = input.sidecar_text("aux.xml") else {
            if input.sidecar_path("aux.xml").is_some() {
                notes
                    .warnings
                    .push(aside("expected a file of at most 1 MiB, got a larger one or no right to read it".into()));
            }
            return notes;
        };
        // A byte order mark is no part of the document.
        match Document::parse(text.trim_start_matches('\u{feff}')) {
            Ok(document) => notes.read(document.root_element()),
            Err(error) => notes.warnings.push(aside(format!("expected XML, got a broken one ({error})"))),
        }
        notes
    }

    fn read(&mut self, dataset: Node) {
        let children = || dataset.children().filter(Node::is_element);
        let text = |name: &str| children().find(|node| node.has_tag_name(name)).and_then(|node| node.text());
        if let Some(text) = text("GeoTransform") {
            let numbers: Vec<f64> = text.split(',').map_while(number).collect();
            match numbers[..] {
                [x, a, b, y, d, e] if a * e != b * d => self.geotransform = Some([x, a, b, y, d, e]),
                _ => self.warnings.push(format!(
                    "the .aux.xml beside the file places it by \"{:.60}\", which is not six numbers of a grid; left aside",
                    text.trim()
                )),
            }
        }
        if let Some(wkt) = text("SRS") {
            let code = wkt.trim().strip_prefix("EPSG:").and_then(|code| code.parse().ok());
            let crs = code.and_then(Crs::from_epsg).unwrap_or_else(|| Crs::from_wkt(wkt));
            if crs == Crs::Unknown && !wkt.trim().is_empty() {
                self.warnings.push(format!(
                    "the coordinate system in the .aux.xml beside the file is not understood and left aside: \"{:.60}\"",
                    wkt.trim()
                ));
            }
            self.crs = Some(crs).filter(|crs| *crs != Crs::Unknown);
            self.vertical = VerticalDatum::from_wkt(wkt).map(|(datum, _)| datum);
        }
        let items = children().filter(|node| node.has_tag_name("Metadata") && node.attribute("domain").is_none());
        for item in items.flat_map(|node| node.children()) {
            if item.attribute("key") == Some("AREA_OR_POINT") {
                self.registration = match item.text().map(str::trim) {
                    Some("Point") => Some(Registration::Point),
                    Some("Area") => Some(Registration::Area),
                    _ => None,
                };
            }
        }
        let first = |node: &Node| node.has_tag_name("PAMRasterBand") && node.attribute("band").is_none_or(|n| n == "1");
        let Some(band) = children().find(first) else { return };
        for item in band.children().filter(Node::is_element) {
            let value = item.text().unwrap_or_default();
            match item.tag_name().name() {
                // NaN is a no-data value, too.
                "NoDataValue" => self.band.nodata = value.trim().parse().ok(),
                "Scale" => self.band.scale = number(value).filter(|&scale| scale != 0.0),
                "Offset" => self.band.offset = number(value),
                "UnitType" => self.band.unit = Some(value.trim().to_owned()).filter(|unit| !unit.is_empty()),
                _ => {}
            }
        }
    }
}

impl BandNotes {
    /// The XML of a GeoTIFF's tag 42112, `<Item name="SCALE" sample="0" role="scale">0.1</Item>` in a list; anything else in
    /// it is passed over.
    ///
    /// # Errors
    /// If it is no XML.
    pub(crate) fn of_tag(xml: &str) -> Result<BandNotes, roxmltree::Error> {
        let document = Document::parse(xml.trim())?;
        let mut notes = BandNotes::default();
        let items = document.root_element().children().filter(|node| node.has_tag_name("Item"));
        for item in items.filter(|item| item.attribute("sample") == Some("0")) {
            let value = item.text().unwrap_or_default();
            match item.attribute("role") {
                Some("scale") => notes.scale = number(value).filter(|&scale| scale != 0.0),
                Some("offset") => notes.offset = number(value),
                Some("unittype") => notes.unit = Some(value.trim().to_owned()),
                _ => {}
            }
        }
        Ok(notes)
    }

    /// With what `beside` says where this says nothing. A scale and its offset belong together.
    pub(crate) fn or(self, beside: BandNotes) -> BandNotes {
        let own_scale = self.scale.is_some() || self.offset.is_some();
        let (scale, offset) = if own_scale { (self.scale, self.offset) } else { (beside.scale, beside.offset) };
        BandNotes {
            nodata: beside.nodata.or(self.nodata),
            scale,
            offset,
            unit: self.unit.filter(|unit| !unit.is_empty()).or(beside.unit),
        }
    }

    /// Metres in the unit stated, and a warning if what is stated is no length.
    pub(crate) fn metres(&self, warnings: &mut Vec<String>) -> Option<f64> {
        let name = self.unit.as_deref().filter(|name| !name.is_empty())?;
        let metres = metres_of_unit_name(name);
        if metres.is_none() {
            warnings.push(format!("the unit of the heights, \"{name}\", is no length; metres are taken"));
        }
        metres
    }

    /// How raw samples become heights.
    pub(crate) fn rule(&self, metres: f64) -> VoidRule {
        VoidRule {
            nodata: self.nodata,
            scale: self.scale.unwrap_or(1.0),
            offset: self.offset.unwrap_or(0.0),
            metres,
            ..VoidRule::default()
        }
    }
}

fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|number: &f64| number.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beside(text: &str) -> Notes {
        Notes::beside(&Input::memory("land.tif", Vec::new()).with_sidecar("aux.xml", text.as_bytes().to_vec()))
    }

    #[test]
    fn notes_beside_a_file() {
        let notes = beside(
            "\u{feff}<PAMDataset>\n<SRS dataAxisToSRSAxisMapping=\"1,2\">GEOGCS[&quot;WGS 84&quot;,DATUM[&quot;WGS_1984&quot;,\
             SPHEROID[&quot;WGS 84&quot;,6378137,298.257223563]],AUTHORITY[&quot;EPSG&quot;,&quot;4326&quot;]]</SRS>\
             <GeoTransform> -1.5e+02,  2.5e-01,  0, 2.0e+01, 0, -2.5e-01</GeoTransform>\
             <Metadata domain=\"IMAGE_STRUCTURE\"><MDI key=\"AREA_OR_POINT\">Area</MDI></Metadata>\
             <Metadata><MDI key=\"AREA_OR_POINT\">Point</MDI></Metadata>\
             <PAMRasterBand band=\"2\"><NoDataValue>7</NoDataValue></PAMRasterBand>\
             <PAMRasterBand band=\"1\"><NoDataValue le_hex_equiv=\"000000000000F87F\">nan</NoDataValue><UnitType>ft</UnitType>\
             <Offset>-5</Offset><Scale>0.1</Scale><Histograms><HistItem/></Histograms></PAMRasterBand></PAMDataset>",
        );
        assert_eq!(notes.geotransform, Some([-150.0, 0.25, 0.0, 20.0, 0.0, -0.25]));
        assert_eq!(notes.crs, Some(Crs::Geographic { name: "EPSG:4326".into() }));
        assert_eq!(notes.registration, Some(Registration::Point));
        assert!(notes.band.nodata.is_some_and(f64::is_nan));
        assert_eq!((notes.band.scale, notes.band.offset), (Some(0.1), Some(-5.0)));
        let mut warnings = notes.warnings;
        assert_eq!(notes.band.metres(&mut warnings), Some(0.3048));
        assert!(warnings.is_empty());
    }

    #[test]
    fn broken_notes_are_left_aside_and_said_so() {
        for text in ["", "<PAMDataset>", "<a></b>", "\u{0}\u{1}", "<!DOCTYPE a [<!ENTITY b \"c\">]><a>&b;</a>", "plain"]
        {
            let notes = beside(text);
            assert!(notes.warnings[0].contains("left aside"), "{text}");
            assert!(notes.geotransform.is_none() && notes.band.nodata.is_none());
        }
        let deep = "<PAMDataset>".repeat(80_000);
        assert!(!beside(&deep).warnings.is_empty());
        let deep = format!("{deep}{}", "</PAMDataset>".repeat(80_000));
        let _ = beside(&deep);
        for transform in ["1,2,3", "0,0,0,0,0,0", "0,nan,0,0,0,1", "a,b,c,d,e,f", "0,1,0,0,0,1,5", ""] {
            let notes = beside(&format!("<PAMDataset><GeoTransform>{transform}</GeoTransform></PAMDataset>"));
            assert!(notes.geotransform.is_none(), "{transform}");
        }
        let band = "<PAMRasterBand><Scale>0</Scale><Offset>inf</Offset><NoDataValue>none</NoDataValue></PAMRasterBand>";
        let notes = beside(&format!("<PAMDataset>{band}<SRS>nonsense</SRS></PAMDataset>"));
        assert_eq!((notes.band.scale, notes.band.offset, notes.band.nodata, notes.crs), (None, None, None, None));
        assert!(notes.warnings[0].contains("nonsense"));
        let code = beside("<PAMDataset><SRS> EPSG:32611 </SRS></PAMDataset>");
        assert_eq!((code.crs.as_ref().map(Crs::name), code.warnings.len()), (Some("EPSG:32611"), 0));
        assert!(beside("<PAMDataset/>").warnings.is_empty());
        assert!(Notes::beside(&Input::memory("land.tif", Vec::new())).warnings.is_empty());
    }

    #[test]
    fn notes_within_a_geotiff_are_those_of_the_first_band() {
        let notes = BandNotes::of_tag(
            "<GDALMetadata>\n<Item name=\"SCALE\" sample=\"1\" role=\"scale\">7</Item>\
             <Item name=\"OFFSET\" sample=\"0\" role=\"offset\">-5</Item><Item name=\"x\">1</Item>\
             <Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.304800000000000015</Item>\
             <Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">ft</Item></GDALMetadata>",
        )
        .expect("well-formed");
        assert_eq!((notes.scale, notes.offset, notes.unit.as_deref()), (Some(0.3048), Some(-5.0), Some("ft")));
        assert!(BandNotes::of_tag("<Item sample=\"0\" role=\"scale\">nan</Item><Item sample=\"0\">").is_err());
        let odd = BandNotes::of_tag("<G><Item sample=\"0\" role=\"scale\">nan</Item></G>").expect("well-formed");
        assert_eq!(odd.scale, None);
    }

    #[test]
    fn which_of_two_statements_is_believed() {
        let own = BandNotes { nodata: Some(1.0), scale: Some(2.0), offset: None, unit: Some(String::new()) };
        let beside = || BandNotes { nodata: Some(9.0), scale: Some(8.0), offset: Some(7.0), unit: Some("ft".into()) };
        let both = own.or(beside());
        assert_eq!(
            (both.nodata, both.scale, both.offset, both.unit.as_deref()),
            (Some(9.0), Some(2.0), None, Some("ft"))
        );
        assert_eq!(BandNotes::default().or(beside()).offset, Some(7.0));
    }
}

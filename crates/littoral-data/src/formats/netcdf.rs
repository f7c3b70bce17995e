//! NetCDF: the classic formats (1, 2 and 5) and NetCDF-4, which is HDF5; GMT's `.grd` among them, also those of GMT 3. The
//! crate `netcdf-reader` decodes; here is what makes a variable land: which one it is, where its samples lie, in what unit, and
//! which are missing. Coordinates are places of samples, whatever a grid says of its pixels.
//!
//! NetCDF Climate and Forecast (CF) Metadata Conventions, 1.11; GMT, "Cookbook: GMT file formats".

use super::{Input, assume_degrees, info};
use crate::voids::VoidRule;
use crate::{Crs, Error, Georeference, Info, Level, Registration, Source, metres_of_unit_name};
use littoral::field::Window;
use littoral::memory::in_large_pages;
use netcdf_reader::{NcFile, NcMetadataMode, NcOpenOptions, NcSliceInfo, NcSliceInfoElem, NcType, NcVariable};

/// What variables of height are called, the likely ones first.
const NAMES: [&str; 14] = [
    "z",
    "elevation",
    "topo",
    "altitude",
    "height",
    "band1",
    "dem",
    "rose",
    "bathymetry",
    "bathy",
    "topography",
    "h",
    "depth",
    "bed",
];

/// Samples read at one go: bounds the memory for their conversion (8 + 4 bytes each).
const SAMPLES_AT_ONCE: usize = 1 << 20;

/// Deflate packs at most so many bytes into one; more is only ever empty.
const MOST_SAMPLES_A_BYTE: u64 = 1032;

/// Whether the file begins as NetCDF files of any kind do, also of a version that is not known.
pub fn sniff(head: &[u8]) -> bool {
    head.starts_with(b"CDF") && head.get(3).is_some_and(|v| !v.is_ascii_graphic())
        || head.starts_with(b"\x89HDF\r\n\x1a\n")
}

struct NetcdfSource {
    file: NcFile,
    name: std::path::PathBuf,
    info: Info,
    level: [Level; 1],
    variable: String,
    /// Dimensions before the last two: their first slice is shown.
    leading: usize,
    /// Whether the last dimension is y.
    transposed: bool,
    flip_columns: bool,
    flip_rows: bool,
    /// Of a one-dimensional variable in the manner of GMT 3, which runs row by row from the north-west.
    flat: bool,
    rule: VoidRule,
    missing: Option<f64>,
    valid: [f64; 2],
}

/// Opens such a file.
///
/// # Errors
/// If it is broken, of an unknown version, or holds no variable that lies on a grid.
pub fn open(mut input: Input) -> Result<Box<dyn Source>, Error> {
    let head = input.head(4)?;
    if head.starts_with(b"CDF") && !matches!(head[3], 1 | 2 | 5) {
        return Err(
            input.error(format!("expected a NetCDF file of version 1, 2 or 5, got version {}; it is damaged", head[3]))
        );
    }
    let name = input.name.clone();
    let length = input.length();
    let fails = |e: netcdf_reader::Error| broken(&name, &e);
    let options = NcOpenOptions {
        chunk_cache_bytes: 32 << 20,
        metadata_mode: NcMetadataMode::Lossy,
        // A chunk and a selection cannot be believed to be larger than the file could hold, packed as well as can be.
        max_chunk_bytes: usize::try_from(length.saturating_mul(MOST_SAMPLES_A_BYTE))
            .unwrap_or(usize::MAX)
            .min(256 << 20),
        max_read_bytes: 64 << 20,
        ..NcOpenOptions::default()
    };
    let sidecar = super::crs_from_sidecar(&input);
    let file = NcFile::from_storage_with_options(input.into_storage()?, options).map_err(fails)?;
    let variables = file.variables().map_err(fails)?;
    let variable = pick(variables).ok_or_else(|| {
        let found: Vec<&str> = variables.iter().take(8).map(|v| v.name()).collect();
        Error::content(&name, format!("expected a variable of numbers over two dimensions, got only {found:?}"))
    })?;
    let shape = variable.shape();
    let text = |variable: &NcVariable, key: &str| variable.attribute(key).and_then(|a| a.value.as_string());
    let number = |variable: &NcVariable, key: &str| variable.attribute(key).and_then(|a| a.value.as_f64());

    let flat = shape.len() == 1;
    let leading = shape.len().saturating_sub(2);
    let transposed = !flat && {
        let [y, x] = [axis(variables, variable, leading), axis(variables, variable, leading + 1)];
        y == Some('x') && x != Some('x') || x == Some('y') && y != Some('y')
    };
    let [columns, rows] = match (flat, transposed) {
        (true, _) => gmt_3_pair(&file, variables, "dimension")
            .ok_or_else(|| Error::content(&name, "expected a GMT 3 grid with its dimension, got none"))?
            .map(|n| if n >= 1.0 { n as usize } else { 0 }),
        (_, false) => [shape[leading + 1], shape[leading]].map(|n| usize::try_from(n).unwrap_or(usize::MAX)),
        (_, true) => [shape[leading], shape[leading + 1]].map(|n| usize::try_from(n).unwrap_or(usize::MAX)),
    };
    let most = length.saturating_mul(MOST_SAMPLES_A_BYTE);
    let samples = super::check_size_fits(&name, length, columns, rows, most)?;
    if flat && samples as u64 != shape[0] {
        return Err(Error::content(&name, format!("expected {columns} × {rows} samples, got {}", shape[0])));
    }

    let mut info = info("netCDF", columns, rows);
    let mut source_axes = [(0.5, 1.0), (rows as f64 - 0.5, -1.0)];
    if flat {
        source_axes = gmt_3_axes(&file, variables, variable, [columns, rows]).unwrap_or(source_axes);
    } else {
        let dimensions = if transposed { [leading, leading + 1] } else { [leading + 1, leading] };
        for (which, dimension) in dimensions.into_iter().enumerate() {
            let name = &variable.dimensions()[dimension].name;
            match coordinates(&file, variables, name, shape[dimension]) {
                Some((first, step, uneven)) => {
                    source_axes[which] = (first, step);
                    if uneven > 0.1 {
                        info.warnings.push(format!(
                            "the coordinates {name} are not evenly spaced: samples are shown up to {uneven:.1} steps from their place; \
                             resample it with gdalwarp"
                        ));
                    }
                }
                None => info.warnings.push(format!("no coordinates {name}: samples are counted from 0")),
            }
        }
    }
    let [(x, dx), (y, dy)] = source_axes;
    let [flip_columns, flip_rows] = [dx < 0.0, dy > 0.0 && !flat];
    let west = if flip_columns { x + dx * (columns - 1) as f64 } else { x };
    let north = if flip_rows { y + dy * (rows - 1) as f64 } else { y };
    let [dx, dy] = [dx.abs(), dy.abs()];
    let pixels = variables.iter().flat_map(|v| number(v, "node_offset"));
    let pixels =
        pixels.chain(file.global_attribute("node_offset").ok().and_then(|a| a.value.as_f64())).any(|n| n == 1.0);
    info.georeference = Georeference {
        geotransform: [west - 0.5 * dx, dx, 0.0, north + 0.5 * dy, 0.0, -dy],
        registration: if pixels { Registration::Area } else { Registration::Point },
        crs: crs(variables, variable, leading).unwrap_or(sidecar),
        size: [columns, rows],
        y_south: false,
    };
    assume_degrees(&mut info);

    info.nodata = number(variable, "_FillValue").or(number(variable, "missing_value"));
    let unit = text(variable, "units").unwrap_or_default();
    match metres_of_unit_name(&unit) {
        Some(metres) => info.vertical_metres = metres,
        None if unit.is_empty() => {}
        None => info.warnings.push(format!("heights are in {unit:?}, which is not a known unit: taken as metres")),
    }
    let packing = [number(variable, "scale_factor").unwrap_or(1.0), number(variable, "add_offset").unwrap_or(0.0)];
    let mut rule = VoidRule { nodata: info.nodata, metres: info.vertical_metres, ..VoidRule::default() };
    if packing.iter().all(|p| p.is_finite()) && packing[0] != 0.0 {
        [rule.scale, rule.offset] = packing;
    }
    let down = text(variable, "positive").is_some_and(|p| p.eq_ignore_ascii_case("down"));
    if down {
        rule.metres = -rule.metres;
        info.warnings.push("the variable counts downwards: depths are turned into heights".into());
    }
    let whole = !matches!(variable.dtype(), NcType::Float | NcType::Double);
    info.step = if whole { (rule.scale * rule.metres).abs() } else { 0.0 };
    if leading > 0 && shape[..leading].iter().any(|&n| n > 1) {
        info.warnings.push(format!("{} has more than two dimensions: the first slice is read", variable.name()));
    }
    let range = variable.attribute("valid_range").and_then(|a| a.value.as_f64_vec()).filter(|v| v.len() == 2);
    let valid = match range {
        Some(range) => [range[0], range[1]],
        None => [
            number(variable, "valid_min").unwrap_or(f64::NEG_INFINITY),
            number(variable, "valid_max").unwrap_or(f64::INFINITY),
        ],
    };
    let missing = number(variable, "missing_value");
    let variable = variable.name().to_owned();
    let level = [Level { columns, rows }];
    let mut source = NetcdfSource {
        file,
        name: name.clone(),
        info,
        level,
        variable,
        leading,
        transposed,
        flip_columns,
        flip_rows,
        flat,
        rule,
        missing,
        valid,
    };
    // A file cut off is better known now than at the first window.
    source.read(0, Window { column: 0, row: 0, columns: 1, rows: 1 })?;
    source.read(0, Window { column: columns - 1, row: rows - 1, columns: 1, rows: 1 })?;
    Ok(Box::new(source))
}

fn broken(name: &std::path::Path, error: &netcdf_reader::Error) -> Error {
    let shown = name.display();
    let hint = match error {
        netcdf_reader::Error::UnsupportedVersion(_) | netcdf_reader::Error::InvalidMagic => "it is damaged".into(),
        _ => format!(
            "get it again if it is cut off or damaged; if other programs read it, `gdal_translate -of GTiff {shown} land.tif` \
             converts it"
        ),
    };
    Error::content(name, format!("expected a NetCDF file that can be decoded, got: {error}; {hint}"))
}

/// The variable of heights: on two dimensions or more, of numbers, called or described so; else the first on a grid.
fn pick(variables: &[NcVariable]) -> Option<&NcVariable> {
    let numbers = |v: &&NcVariable| {
        use NcType::*;
        matches!(v.dtype(), Byte | Short | Int | Float | Double | UByte | UShort | UInt | Int64 | UInt64)
    };
    let gridded: Vec<&NcVariable> = variables.iter().filter(|v| v.shape().len() >= 2).filter(numbers).collect();
    let called = NAMES.iter().find_map(|name| gridded.iter().find(|v| v.name().eq_ignore_ascii_case(name)));
    let described = || {
        gridded.iter().find(|v| {
            let text = |key| v.attribute(key).and_then(|a| a.value.as_string()).unwrap_or_default().to_lowercase();
            ["height", "altitude", "elevation", "depth", "topography"]
                .iter()
                .any(|w| text("standard_name").contains(w) || text("long_name").contains(w))
        })
    };
    let flat = || {
        let known = |name: &str| variables.iter().any(|v| v.name() == name);
        let z = variables.iter().filter(numbers).find(|v| v.name() == "z" && v.shape().len() == 1);
        z.filter(|_| known("x_range") && known("y_range") && known("dimension"))
    };
    let bounds = |v: &&&NcVariable| !v.name().ends_with("_bnds") && !v.name().ends_with("_bounds");
    called.or_else(described).or_else(|| gridded.iter().find(bounds)).copied().or_else(flat)
}

/// Whether a dimension of a variable is 'x' or 'y', by what its coordinates or its name say.
fn axis(variables: &[NcVariable], variable: &NcVariable, dimension: usize) -> Option<char> {
    let name = &variable.dimensions().get(dimension)?.name;
    let coordinate = variables.iter().find(|v| v.name() == name && v.shape().len() == 1);
    let text = |key| {
        coordinate.and_then(|v| v.attribute(key)).and_then(|a| a.value.as_string()).unwrap_or_default().to_lowercase()
    };
    let [units, standard, axis] = [text("units"), text("standard_name"), text("axis")];
    let name = name.to_lowercase();
    if axis == "x"
        || units.starts_with("degrees_e")
        || standard.contains("longitude")
        || standard == "projection_x_coordinate"
    {
        return Some('x');
    }
    if axis == "y"
        || units.starts_with("degrees_n")
        || standard.contains("latitude")
        || standard == "projection_y_coordinate"
    {
        return Some('y');
    }
    match name.as_str() {
        "x" | "easting" => Some('x'),
        "y" | "northing" => Some('y'),
        name if name.starts_with("lon") => Some('x'),
        name if name.starts_with("lat") => Some('y'),
        _ => None,
    }
}

/// First coordinate, step, and how many steps the worst of some samples is off its place. Reads only a few of them.
fn coordinates(file: &NcFile, variables: &[NcVariable], name: &str, count: u64) -> Option<(f64, f64, f64)> {
    let variable = variables.iter().find(|v| v.name() == name && v.shape() == [count])?;
    let number = |key: &str, otherwise: f64| {
        variable.attribute(key).and_then(|a| a.value.as_f64()).filter(|v| v.is_finite()).unwrap_or(otherwise)
    };
    let [scale, offset] = [number("scale_factor", 1.0), number("add_offset", 0.0)];
    let at = |index: u64| {
        let selection =
            NcSliceInfo { selections: vec![NcSliceInfoElem::Slice { start: index, end: index + 1, step: 1 }] };
        let value = file.read_variable_slice_as_f64(variable.name(), &selection).ok()?.iter().next().copied()?;
        Some(value * scale + offset).filter(|v| v.is_finite())
    };
    let first = at(0)?;
    if count == 1 {
        return Some((first, 1.0, 0.0));
    }
    let step = (at(count - 1)? - first) / (count - 1) as f64;
    if step == 0.0 || !step.is_finite() {
        return None;
    }
    let mut uneven = 0.0f64;
    for part in 1..16 {
        let index = count * part / 16;
        uneven = uneven.max(((at(index)? - first) / step - index as f64).abs());
    }
    Some((first, step, uneven))
}

/// Two numbers of a variable in the manner of GMT 3.
fn gmt_3_pair(file: &NcFile, variables: &[NcVariable], name: &str) -> Option<[f64; 2]> {
    let variable = variables.iter().find(|v| v.name() == name && v.shape() == [2])?;
    let values = file.read_variable_slice_as_f64(variable.name(), &NcSliceInfo::all(1)).ok()?;
    let mut values = values.iter().copied();
    Some([values.next()?, values.next()?]).filter(|v| v.iter().all(|v| v.is_finite()))
}

/// GMT 3 gives the ranges of x and y, of pixels or of samples as `node_offset` says; rows run from the north.
fn gmt_3_axes(file: &NcFile, variables: &[NcVariable], z: &NcVariable, size: [usize; 2]) -> Option<[(f64, f64); 2]> {
    let [x, y] = [gmt_3_pair(file, variables, "x_range")?, gmt_3_pair(file, variables, "y_range")?];
    let pixels = z.attribute("node_offset").and_then(|a| a.value.as_f64()) == Some(1.0);
    let axis = |range: [f64; 2], count: usize| {
        let gaps = if pixels { count as f64 } else { (count.max(2) - 1) as f64 };
        let step = (range[1] - range[0]) / gaps;
        (step > 0.0).then_some((step, if pixels { 0.5 * step } else { 0.0 }))
    };
    let [(dx, half_x), (dy, half_y)] = [axis(x, size[0])?, axis(y, size[1])?];
    Some([(x[0] + half_x, dx), (y[1] - half_y, -dy)])
}

/// What the grid mapping or the units of the coordinates say.
fn crs(variables: &[NcVariable], variable: &NcVariable, leading: usize) -> Option<Crs> {
    let text = |variable: &NcVariable, key: &str| variable.attribute(key).and_then(|a| a.value.as_string());
    let mapping = text(variable, "grid_mapping").and_then(|name| variables.iter().find(|v| v.name() == name));
    if let Some(mapping) = mapping {
        let wkt = ["crs_wkt", "spatial_ref"].iter().find_map(|key| text(mapping, key));
        let crs = wkt.map_or(Crs::Unknown, |wkt| Crs::from_wkt(&wkt));
        let proj = text(mapping, "proj4").or(text(mapping, "proj4_params")).or(text(mapping, "proj4text"));
        let crs = if crs == Crs::Unknown { proj.map_or(Crs::Unknown, |proj| Crs::from_proj(&proj)) } else { crs };
        if crs != Crs::Unknown {
            return Some(crs);
        }
    }
    let units = |dimension: usize| {
        let name = &variable.dimensions().get(dimension)?.name;
        text(variables.iter().find(|v| v.name() == name)?, "units").map(|u| u.to_lowercase())
    };
    let degrees = (leading..leading + 2).filter_map(units).filter(|u| u.starts_with("degree")).count();
    (degrees == 2).then(|| Crs::from_epsg(4326).unwrap_or(Crs::Geographic { name: "EPSG:4326".into() }))
}

impl NetcdfSource {
    fn slice(&self, selections: Vec<NcSliceInfoElem>) -> Result<Vec<f64>, Error> {
        let values = self.file.read_variable_slice_as_f64(&self.variable, &NcSliceInfo { selections });
        let values = values.map_err(|e| broken(&self.name, &e))?;
        Ok(values.as_standard_layout().iter().copied().collect())
    }

    fn height(&self, raw: f64) -> f32 {
        let missing = self.missing == Some(raw) || raw < self.valid[0] || raw > self.valid[1];
        if missing { f32::NAN } else { self.rule.height(raw) }
    }
}

impl Source for NetcdfSource {
    fn info(&self) -> &Info {
        &self.info
    }

    fn levels(&self) -> &[Level] {
        &self.level
    }

    fn read(&mut self, _level: usize, window: Window) -> Result<Vec<f32>, Error> {
        let Window { column, row, columns, rows } = window;
        let mut heights = in_large_pages(Vec::with_capacity(columns * rows));
        if columns == 0 {
            return Ok(heights);
        }
        let flip = |flipped: bool, start: usize, count: usize, all: usize| {
            let start = if flipped { all - start - count } else { start } as u64;
            NcSliceInfoElem::Slice { start, end: start + count as u64, step: 1 }
        };
        let across = flip(self.flip_columns, column, columns, self.info.columns);
        let rows_at_once = if self.flat { 1 } else { (SAMPLES_AT_ONCE / columns).max(1) };
        let mut done = 0;
        while done < rows {
            let count = rows_at_once.min(rows - done);
            let down = flip(self.flip_rows, row + done, count, self.info.rows);
            let values = if self.flat {
                let start = ((row + done) * self.info.columns + column) as u64;
                self.slice(vec![NcSliceInfoElem::Slice { start, end: start + columns as u64, step: 1 }])?
            } else {
                let mut selections = vec![NcSliceInfoElem::Index(0); self.leading];
                selections.extend(if self.transposed { [across.clone(), down] } else { [down, across.clone()] });
                self.slice(selections)?
            };
            if values.len() != columns * count {
                let problem =
                    format!("expected {} samples of {}, got {}", columns * count, self.variable, values.len());
                return Err(Error::content(&self.name, problem));
            }
            for r in 0..count {
                let r = if self.flip_rows { count - 1 - r } else { r };
                for c in 0..columns {
                    let c = if self.flip_columns { columns - 1 - c } else { c };
                    let index = if self.transposed { c * count + r } else { r * columns + c };
                    heights.push(self.height(values[index]));
                }
            }
            done += count;
        }
        Ok(heights)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use netcdf_writer::{NcAttrValue, NcFileBuilder, NcWriteFormat, NcWriteOptions};

    const FORMATS: [NcWriteFormat; 2] = [NcWriteFormat::Classic, NcWriteFormat::Nc4];

    fn finish(builder: NcFileBuilder, format: NcWriteFormat) -> Vec<u8> {
        builder.to_vec(NcWriteOptions { format }).expect("writes").1
    }

    fn read(bytes: Vec<u8>) -> Result<(Info, Vec<f32>), Error> {
        let mut source = open(Input::memory("t.nc", bytes))?;
        let info = source.info().clone();
        let all = source.read(0, Window { column: 0, row: 0, columns: info.columns, rows: info.rows })?;
        // Windows agree with the whole.
        let part = source.read(0, Window { column: 1, row: 1, columns: info.columns - 1, rows: 1 })?;
        assert!(part.iter().zip(&all[info.columns + 1..]).all(|(a, b)| a == b || a.is_nan() && b.is_nan()));
        Ok((info, all))
    }

    fn text(value: &str) -> NcAttrValue {
        NcAttrValue::Chars(value.into())
    }

    /// Three by two samples whose heights are 10 × column + row from the north-west, with axes as asked for.
    fn grid(format: NcWriteFormat, x_rises: bool, y_rises: bool, x_first: bool) -> Vec<u8> {
        let mut builder = NcFileBuilder::new();
        let y = builder.add_dimension("lat", 2).expect("adds");
        let x = builder.add_dimension("lon", 3).expect("adds");
        let longitudes = builder.add_variable::<f64>("lon", &[x]).expect("adds");
        let latitudes = builder.add_variable::<f64>("lat", &[y]).expect("adds");
        builder.add_variable_attribute(longitudes, "units", text("degrees_east")).expect("adds");
        builder.add_variable_attribute(latitudes, "units", text("degrees_north")).expect("adds");
        let z = builder.add_variable::<i16>("z", &if x_first { [x, y] } else { [y, x] }).expect("adds");
        builder.add_variable_attribute(z, "scale_factor", NcAttrValue::Doubles(vec![0.5])).expect("adds");
        builder.add_variable_attribute(z, "add_offset", NcAttrValue::Doubles(vec![100.0])).expect("adds");
        builder.add_variable_attribute(z, "_FillValue", NcAttrValue::Shorts(vec![7])).expect("adds");
        builder.add_variable_attribute(z, "units", text("feet")).expect("adds");
        let order = |rises: bool, count: usize| -> Vec<usize> {
            if rises { (0..count).collect() } else { (0..count).rev().collect() }
        };
        let columns = order(x_rises, 3);
        // Row 0 is the north.
        let rows = order(!y_rises, 2);
        builder
            .write_variable(longitudes, &columns.iter().map(|&c| 8.0 + 0.5 * c as f64).collect::<Vec<_>>())
            .expect("writes");
        builder
            .write_variable(latitudes, &rows.iter().map(|&r| 50.0 - 0.25 * r as f64).collect::<Vec<_>>())
            .expect("writes");
        let raw = |c: usize, r: usize| if [c, r] == [2, 0] { 7 } else { (20 * c + 2 * r) as i16 };
        let samples: Vec<i16> = match x_first {
            false => rows.iter().flat_map(|&r| columns.iter().map(move |&c| raw(c, r))).collect(),
            true => columns.iter().flat_map(|&c| rows.iter().map(move |&r| raw(c, r))).collect(),
        };
        builder.write_variable(z, &samples).expect("writes");
        finish(builder, format)
    }

    #[test]
    fn axes_of_any_order_and_direction() {
        for format in FORMATS {
            for case in 0..8 {
                let bytes = grid(format, case & 1 == 0, case & 2 == 0, case & 4 == 0);
                assert!(sniff(&bytes));
                let (info, all) = read(bytes).expect("reads");
                assert_eq!(info.georeference.geotransform, [7.75, 0.5, 0.0, 50.125, 0.0, -0.25], "{case}");
                assert!(matches!(info.georeference.crs, Crs::Geographic { .. }));
                for (index, height) in all.iter().enumerate() {
                    let [c, r] = [index % 3, index / 3];
                    let expected = (100.0 + 0.5 * (20 * c + 2 * r) as f64) * 0.3048;
                    let void = [c, r] == [2, 0];
                    assert!(
                        if void { height.is_nan() } else { (f64::from(*height) - expected).abs() < 1e-4 },
                        "{case}"
                    );
                }
                assert!((info.step - 0.5 * 0.3048).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn depths_extra_dimensions_and_uneven_axes() {
        for format in FORMATS {
            let mut builder = NcFileBuilder::new();
            let t = builder.add_dimension("time", 2).expect("adds");
            let y = builder.add_dimension("y", 3).expect("adds");
            let x = builder.add_dimension("x", 3).expect("adds");
            let at = builder.add_variable::<f32>("x", &[x]).expect("adds");
            let other = builder.add_variable::<f32>("other", &[y, x]).expect("adds");
            let depth = builder.add_variable::<f32>("depth", &[t, y, x]).expect("adds");
            builder.add_variable_attribute(depth, "positive", text("down")).expect("adds");
            builder.add_variable_attribute(depth, "missing_value", NcAttrValue::Floats(vec![3.0])).expect("adds");
            builder.add_variable_attribute(depth, "valid_max", NcAttrValue::Floats(vec![16.0])).expect("adds");
            builder.write_variable(at, &[0.0f32, 300.0, 1000.0]).expect("writes");
            builder.write_variable(other, &[0.0f32; 9]).expect("writes");
            builder.write_variable(depth, &(0..18).map(|i| (2 * i) as f32 - 1.0).collect::<Vec<_>>()).expect("writes");
            let (info, all) = read(finish(builder, format)).expect("reads");
            assert_eq!(all[..2], [1.0, -1.0]);
            assert!(all[2].is_nan());
            assert_eq!(all[3..], [-5.0, -7.0, -9.0, -11.0, -13.0, -15.0]);
            for words in ["downwards", "first slice", "evenly", "no coordinates y"] {
                assert!(info.warnings.iter().any(|w| w.contains(words)), "{words}: {:?}", info.warnings);
            }
        }
    }

    #[test]
    fn grids_of_gmt_3_run_from_the_north() {
        let mut builder = NcFileBuilder::new();
        let side = builder.add_dimension("side", 2).expect("adds");
        let size = builder.add_dimension("xysize", 6).expect("adds");
        let pairs: [(&str, [f64; 2]); 3] =
            [("x_range", [0.0, 20.0]), ("y_range", [100.0, 105.0]), ("spacing", [10.0, 5.0])];
        for (name, pair) in pairs {
            let variable = builder.add_variable::<f64>(name, &[side]).expect("adds");
            builder.write_variable(variable, &pair).expect("writes");
        }
        let dimension = builder.add_variable::<i32>("dimension", &[side]).expect("adds");
        builder.write_variable(dimension, &[3, 2]).expect("writes");
        let z = builder.add_variable::<f32>("z", &[size]).expect("adds");
        builder.write_variable(z, &[1.0f32, 2.0, 3.0, 4.0, 5.0, f32::NAN]).expect("writes");
        let (info, all) = read(finish(builder, NcWriteFormat::Classic)).expect("reads");
        assert_eq!(info.georeference.geotransform, [-5.0, 10.0, 0.0, 107.5, 0.0, -5.0]);
        assert_eq!(all[..5], [1.0, 2.0, 3.0, 4.0, 5.0]);
        assert!(all[5].is_nan());
    }

    #[test]
    fn broken_ones_are_errors_and_never_panic() {
        for format in FORMATS {
            let whole = grid(format, true, true, false);
            for length in (0..whole.len()).step_by(37).filter(|&n| n >= 4) {
                let _ = read(whole[..length].to_vec());
            }
            for at in (0..whole.len()).step_by(11) {
                let mut broken = whole.clone();
                broken[at] ^= 0xFF;
                let _ = read(broken);
            }
        }
        let mut version = grid(NcWriteFormat::Classic, true, true, false);
        version[3] = 9;
        assert!(read(version).expect_err("unknown").to_string().contains("version 9"));
        let empty = finish(NcFileBuilder::new(), NcWriteFormat::Classic);
        assert!(read(empty).expect_err("nothing in it").to_string().contains("two dimensions"));
    }
}

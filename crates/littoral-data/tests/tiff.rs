//! GeoTIFFs made here byte by byte, in every variant that the reader knows, against the numbers that went in.

use littoral::field::Window;
use littoral_data::formats::{Input, tiff};
use littoral_data::{Crs, LoadOptions, Source, VerticalDatum, load_from, load_window, survey};
use std::path::Path;

/// A TIFF to be written. `values` are the samples of all bands, pixel by pixel.
#[derive(Clone)]
struct Maker {
    columns: usize,
    rows: usize,
    bands: usize,
    /// (sample format, bits)
    kind: (u16, u16),
    little: bool,
    big: bool,
    /// Columns and rows of tiles, or all columns and the rows of strips.
    chunk: [usize; 2],
    tiled: bool,
    planar: bool,
    compression: u16,
    predictor: u16,
    values: Vec<f64>,
    /// Chunks that are not stored.
    sparse: Vec<usize>,
    /// Further tags: (tag, type, values' bytes in the file's order, count).
    tags: Vec<(u16, u16, Vec<u8>, usize)>,
}

impl Maker {
    fn new(columns: usize, rows: usize) -> Maker {
        // Rough enough that no byte plane is constant, whole numbers so that every type holds them.
        let values = (0..columns * rows).map(|i| ((i * 7919 + i / columns * 31) % 127) as f64).collect();
        let (kind, chunk) = ((2, 16), [columns, 5]);
        Maker {
            columns,
            rows,
            bands: 1,
            kind,
            little: true,
            big: false,
            chunk,
            tiled: false,
            planar: false,
            compression: 1,
            predictor: 1,
            values,
            sparse: Vec::new(),
            tags: Vec::new(),
        }
    }

    fn bytes<const N: usize>(&self, little: [u8; N]) -> Vec<u8> {
        let mut bytes = little.to_vec();
        if !self.little {
            bytes.reverse();
        }
        bytes
    }

    fn sample(&self, value: f64) -> Vec<u8> {
        match self.kind {
            (1, 8) => vec![value as u8],
            (2, 8) => vec![value as i8 as u8],
            (1, 16) => self.bytes((value as u16).to_le_bytes()),
            (2, 16) => self.bytes((value as i16).to_le_bytes()),
            (1, 32) => self.bytes((value as u32).to_le_bytes()),
            (2, 32) => self.bytes((value as i32).to_le_bytes()),
            (1, 64) => self.bytes((value as u64).to_le_bytes()),
            (2, 64) => self.bytes((value as i64).to_le_bytes()),
            (3, 16) => self.bytes(half::f16::from_f64(value).to_le_bytes()),
            (3, 32) => self.bytes((value as f32).to_le_bytes()),
            (3, 64) => self.bytes(value.to_le_bytes()),
            other => panic!("no such kind: {other:?}"),
        }
    }

    /// One chunk of interleaved bands, or of one band.
    fn chunk(&self, x: usize, y: usize, band: Option<usize>) -> Vec<u8> {
        let bands: Vec<usize> = band.map_or((0..self.bands).collect(), |band| vec![band]);
        let size = usize::from(self.kind.1 / 8);
        let rows = if self.tiled { self.chunk[1] } else { self.chunk[1].min(self.rows - y * self.chunk[1]) };
        let mut raw = Vec::new();
        for row in 0..rows {
            let mut line = Vec::new();
            for column in 0..self.chunk[0] {
                for band in &bands {
                    let (c, r) = (x * self.chunk[0] + column, y * self.chunk[1] + row);
                    let inside = c < self.columns && r < self.rows;
                    let value = if inside { self.values[(r * self.columns + c) * self.bands + band] } else { 99.0 };
                    line.extend(self.sample(value));
                }
            }
            raw.extend(self.predicted(line, size, bands.len()));
        }
        match self.compression {
            1 => raw,
            5 => weezl::encode::Encoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8).encode(&raw).expect("encodes"),
            8 => {
                let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
                std::io::Write::write_all(&mut encoder, &raw).expect("encodes");
                encoder.finish().expect("encodes")
            }
            // Literal runs and repeats by turns.
            32773 => raw
                .chunks(100)
                .flat_map(|run| {
                    let same = run.iter().all(|byte| *byte == run[0]) && run.len() > 1;
                    if same {
                        vec![(1 - run.len() as i16) as u8, run[0]]
                    } else {
                        [&[run.len() as u8 - 1], run].concat()
                    }
                })
                .collect(),
            50000 => zstd::bulk::compress(&raw, 3).expect("encodes"),
            34925 => {
                let mut encoder =
                    lzma_rust2::XzWriter::new(Vec::new(), lzma_rust2::XzOptions::default()).expect("starts");
                std::io::Write::write_all(&mut encoder, &raw).expect("encodes");
                encoder.finish().expect("encodes")
            }
            34887 => {
                // As libtiff: bytes of the file's order taken for native numbers.
                let numbers: Vec<f32> = raw.as_chunks::<4>().0.iter().map(|bytes| f32::from_ne_bytes(*bytes)).collect();
                lerc::encode_slice(self.chunk[0] as u32, rows as u32, &numbers, lerc::Precision::Lossless)
                    .expect("encodes")
            }
            other => panic!("no such codec: {other}"),
        }
    }

    fn predicted(&self, line: Vec<u8>, size: usize, interleaved: usize) -> Vec<u8> {
        let samples = line.len() / size;
        match self.predictor {
            2 => {
                let number = |at: usize| {
                    let mut bytes = [0; 8];
                    let own = &line[at * size..][..size];
                    (0..size).for_each(|i| bytes[i] = own[if self.little { i } else { size - 1 - i }]);
                    u64::from_le_bytes(bytes)
                };
                (0..samples)
                    .flat_map(|at| {
                        let left = if at < interleaved { 0 } else { number(at - interleaved) };
                        let mut bytes = number(at).wrapping_sub(left).to_le_bytes()[..size].to_vec();
                        if !self.little {
                            bytes.reverse();
                        }
                        bytes
                    })
                    .collect()
            }
            3 => {
                let byte =
                    |plane: usize, at: usize| line[at * size + if self.little { size - 1 - plane } else { plane }];
                let mut planes: Vec<u8> = (0..size)
                    .flat_map(|plane| (0..samples).map(move |at| (plane, at)))
                    .map(|(p, a)| byte(p, a))
                    .collect();
                for at in (interleaved..planes.len()).rev() {
                    planes[at] = planes[at].wrapping_sub(planes[at - interleaved]);
                }
                planes
            }
            _ => line,
        }
    }

    fn tag(&mut self, tag: u16, values: &[u16]) {
        let bytes = values.iter().flat_map(|value| self.bytes(value.to_le_bytes())).collect();
        self.tags.push((tag, 3, bytes, values.len()));
    }

    fn doubles(&mut self, tag: u16, values: &[f64]) {
        let bytes = values.iter().flat_map(|value| self.bytes(value.to_le_bytes())).collect();
        self.tags.push((tag, 12, bytes, values.len()));
    }

    fn text(&mut self, tag: u16, text: &str) {
        self.tags.push((tag, 2, [text.as_bytes(), &[0]].concat(), text.len() + 1));
    }

    /// Header, chunks, and the directory behind them; with `more`, further directories of other images in the same file.
    fn file(&self, more: &[Maker]) -> Vec<u8> {
        let mut out = if self.little { b"II".to_vec() } else { b"MM".to_vec() };
        if self.big {
            out.extend([self.bytes(43u16.to_le_bytes()), self.bytes(8u16.to_le_bytes()), vec![0, 0]].concat());
        } else {
            out.extend(self.bytes(42u16.to_le_bytes()));
        }
        let mut link = out.len();
        out.extend(vec![0; if self.big { 8 } else { 4 }]);
        for image in std::iter::once(self).chain(more) {
            let (at, next) = image.append(&mut out);
            let pointer =
                if self.big { self.bytes((at as u64).to_le_bytes()) } else { self.bytes((at as u32).to_le_bytes()) };
            out[link..link + pointer.len()].copy_from_slice(&pointer);
            link = next;
        }
        out
    }

    /// Appends chunks and directory; where the directory lies, and where its link to the next.
    fn append(&self, out: &mut Vec<u8>) -> (usize, usize) {
        let (across, down) = (self.columns.div_ceil(self.chunk[0]), self.rows.div_ceil(self.chunk[1]));
        let planes: Vec<Option<usize>> = if self.planar { (0..self.bands).map(Some).collect() } else { vec![None] };
        let (mut offsets, mut counts) = (Vec::new(), Vec::new());
        for plane in planes {
            for index in 0..across * down {
                if self.sparse.contains(&index) {
                    offsets.push(0);
                    counts.push(0);
                    continue;
                }
                let chunk = self.chunk(index % across, index / across, plane);
                offsets.push(out.len());
                counts.push(chunk.len());
                out.extend(chunk);
            }
        }
        let long = |values: &[usize]| {
            let bytes: Vec<u8> = values.iter().flat_map(|&value| self.bytes((value as u32).to_le_bytes())).collect();
            (4u16, bytes, values.len())
        };
        let short = |values: &[u16]| {
            (3u16, values.iter().flat_map(|value| self.bytes(value.to_le_bytes())).collect::<Vec<u8>>(), values.len())
        };
        let mut tags: Vec<(u16, Values)> = vec![
            (256, long(&[self.columns])),
            (257, long(&[self.rows])),
            (258, short(&vec![self.kind.1; self.bands])),
            (259, short(&[self.compression])),
            (262, short(&[1])),
            (277, short(&[self.bands as u16])),
            (284, short(&[if self.planar { 2 } else { 1 }])),
            (317, short(&[self.predictor])),
            (339, short(&vec![self.kind.0; self.bands])),
        ];
        if self.tiled {
            tags.extend([(322, long(&[self.chunk[0]])), (323, long(&[self.chunk[1]]))]);
            tags.extend([(324, long(&offsets)), (325, long(&counts))]);
        } else {
            tags.extend([(273, long(&offsets)), (278, long(&[self.chunk[1]])), (279, long(&counts))]);
        }
        tags.extend(self.tags.iter().map(|(tag, kind, bytes, count)| (*tag, (*kind, bytes.clone(), *count))));
        tags.sort_by_key(|(tag, _)| *tag);
        let inline = if self.big { 8 } else { 4 };
        let number = |value: usize| {
            if self.big { self.bytes((value as u64).to_le_bytes()) } else { self.bytes((value as u32).to_le_bytes()) }
        };
        let mut table = if self.big { number(tags.len()) } else { self.bytes((tags.len() as u16).to_le_bytes()) };
        for (tag, (kind, mut bytes, count)) in tags {
            table.extend([self.bytes(tag.to_le_bytes()), self.bytes(kind.to_le_bytes()), number(count)].concat());
            if bytes.len() <= inline {
                bytes.resize(inline, 0);
                table.extend(bytes);
            } else {
                table.extend(number(out.len()));
                out.extend(bytes);
            }
        }
        let at = out.len();
        out.extend(&table);
        out.extend(number(0));
        (at, at + table.len())
    }
}

/// A tag's type, its values in the file's byte order, and how many they are.
type Values = (u16, Vec<u8>, usize);

fn open(bytes: Vec<u8>) -> Box<dyn Source> {
    tiff::open_input(Input::memory("made.tif", bytes)).expect("opens")
}

fn all(source: &mut dyn Source, level: usize) -> Vec<f32> {
    let size = source.levels()[level];
    source.read(level, Window { column: 0, row: 0, columns: size.columns, rows: size.rows }).expect("reads")
}

fn same(got: &[f32], expected: impl IntoIterator<Item = f64>) {
    for (at, (got, expected)) in got.iter().zip(expected).enumerate() {
        let expected = expected as f32;
        assert!(*got == expected || got.is_nan() && expected.is_nan(), "sample {at}: expected {expected}, got {got}");
    }
}

#[test]
fn every_kind_in_every_layout_reads_back() {
    let kinds = [(1, 8), (2, 8), (1, 16), (2, 16), (1, 32), (2, 32), (1, 64), (2, 64), (3, 16), (3, 32), (3, 64)];
    let mut seen = 0;
    for (index, kind) in kinds.into_iter().enumerate() {
        for compression in [1, 5, 8, 32773, 50000, 34925, 34887] {
            for predictor in [1, 2, 3] {
                let plain = matches!(compression, 1 | 32773 | 34887);
                if predictor == 3 && kind.0 != 3 || predictor > 1 && plain || compression == 34887 && kind != (3, 32) {
                    continue;
                }
                for layout in 0..8 {
                    let mut maker = Maker::new(37, 23);
                    (maker.kind, maker.compression, maker.predictor) = (kind, compression, predictor);
                    (maker.little, maker.big, maker.tiled) = (layout & 1 == 0, layout & 2 == 0, layout & 4 == 0);
                    if maker.tiled {
                        maker.chunk = [16, 32];
                    }
                    let mut source = open(maker.file(&[]));
                    let got = all(&mut *source, 0);
                    assert_eq!(got.len(), 37 * 23);
                    let what = || panic!("{kind:?}, codec {compression}, predictor {predictor}, layout {layout}");
                    let equal = got.iter().zip(&maker.values).all(|(got, value)| f64::from(*got) == *value);
                    if !equal {
                        what();
                    }
                    let heavy = source.info().warnings.iter().filter(|warning| !warning.contains("8-bit")).count();
                    assert_eq!((heavy, source.info().step == 0.0), (0, kind.0 == 3));
                    seen += index;
                }
            }
        }
    }
    assert!(seen > 0);
}

#[test]
fn windows_are_parts_of_the_whole() {
    for (tiled, compression) in [(false, 1), (true, 1), (false, 8), (true, 50000)] {
        let mut maker = Maker::new(61, 47);
        (maker.tiled, maker.compression) = (tiled, compression);
        maker.chunk = if tiled { [16, 16] } else { [61, 7] };
        let mut source = open(maker.file(&[]));
        let whole = all(&mut *source, 0);
        for seed in 0..60usize {
            let (column, row) = (seed * 7 % 61, seed * 13 % 47);
            let (columns, rows) = ((seed * 5 % 40).min(61 - column), (seed * 11 % 30).min(47 - row));
            let got = source.read(0, Window { column, row, columns, rows }).expect("reads");
            let expected = (0..rows).flat_map(|r| (0..columns).map(move |c| (row + r) * 61 + column + c));
            same(&got, expected.map(|at| whole[at].into()));
            assert_eq!(got.len(), columns * rows);
        }
        for (column, columns) in [(0, 62), (61, 1), (usize::MAX, 2)] {
            assert!(source.read(0, Window { column, row: 0, columns, rows: 1 }).is_err());
        }
    }
}

#[test]
fn the_first_of_many_bands_is_the_height() {
    for (planar, predictor, compression) in [(false, 1, 1), (true, 1, 1), (false, 2, 8), (true, 2, 8), (false, 3, 8)] {
        let mut maker = Maker::new(20, 12);
        (maker.bands, maker.planar, maker.predictor, maker.compression) = (3, planar, predictor, compression);
        maker.kind = (3, 32);
        maker.values = (0..20 * 12 * 3).map(|i| (i % 3 * 1000 + i % 251) as f64).collect();
        let mut source = open(maker.file(&[]));
        same(&all(&mut *source, 0), maker.values.iter().copied().step_by(3));
        assert!(source.info().warnings[0].starts_with("3 bands: the first is taken as the height"));
    }
}

#[test]
fn an_alpha_band_and_a_mask_say_what_is_void() {
    let mut maker = Maker::new(20, 12);
    (maker.bands, maker.kind) = (2, (2, 16));
    maker.values = (0..240).flat_map(|i| [f64::from(i), if i % 3 == 0 { 0.0 } else { 255.0 }]).collect();
    maker.tag(338, &[2]);
    let expected = (0..240).map(|i| if i % 3 == 0 { f64::NAN } else { f64::from(i) });
    same(&all(&mut *open(maker.file(&[])), 0), expected.clone());

    let mut maker = Maker::new(20, 12);
    maker.values = (0..240).map(f64::from).collect();
    let mut mask = Maker::new(3, 12); // 20 bits are 3 bytes: written as bytes, then called bits
    (mask.kind, mask.compression) = ((1, 8), 8);
    let bit = |row: usize, column: usize| column < 20 && !(row * 20 + column).is_multiple_of(3);
    mask.values = (0..36)
        .map(|i| (0..8).fold(0.0, |byte, b| byte * 2.0 + f64::from(u8::from(bit(i / 3, i % 3 * 8 + b)))))
        .collect();
    mask.tags.push((254, 4, vec![4, 0, 0, 0], 1));
    let mut bytes = maker.file(&[mask]);
    // Turn the mask's width of 3 bytes of 8 bits into 20 of 1.
    let patch = |bytes: &mut Vec<u8>, tag: u16, from: u8, to: u8| {
        let at = bytes.windows(12).rposition(|w| w[..2] == tag.to_le_bytes() && w[8] == from).expect("the tag");
        bytes[at + 8] = to;
    };
    patch(&mut bytes, 256, 3, 20);
    patch(&mut bytes, 258, 8, 1);
    same(&all(&mut *open(bytes), 0), expected);
}

/// A mask beside a file: void at every third sample.
fn thirds(columns: usize, rows: usize) -> Maker {
    let mut mask = Maker::new(columns, rows);
    (mask.kind, mask.compression) = ((1, 8), 8);
    mask.values = (0..columns * rows).map(|i| if i % 3 == 0 { 0.0 } else { 255.0 }).collect();
    mask
}

#[test]
fn a_mask_beside_the_file_says_what_is_void() {
    let mut maker = Maker::new(20, 12);
    maker.values = (0..240).map(f64::from).collect();
    let mut half = Maker::new(10, 6);
    half.tags.push((254, 4, vec![1, 0, 0, 0], 1));
    let file = || Input::memory("made.tif", maker.file(&[half.clone()]));
    let opened = |input| tiff::open_input(input).expect("opens");
    let masked = |value: &f64| if (*value as usize).is_multiple_of(3) { f64::NAN } else { *value };

    let mut source = opened(file().with_sidecar("msk", thirds(20, 12).file(&[])));
    same(&all(&mut *source, 0), maker.values.iter().map(masked));
    assert_eq!((source.levels().len(), &source.info().warnings), (1, &vec![]), "a level without its mask is not shown");
    // The mask's own overview makes the coarser level good again.
    let both = file().with_sidecar("msk", thirds(20, 12).file(&[])).with_sidecar("msk.ovr", thirds(10, 6).file(&[]));
    let mut source = opened(both);
    let coarse = all(&mut *source, 1);
    assert_eq!(coarse.iter().filter(|height| height.is_nan()).count(), 20);
    // Another size is another file's; a broken one is said to be.
    let mut source = opened(file().with_sidecar("msk", thirds(19, 12).file(&[])));
    same(&all(&mut *source, 0), maker.values.iter().copied());
    assert_eq!(source.levels().len(), 2);
    for broken in [Vec::new(), b"II*\0".to_vec(), vec![0; 100], thirds(20, 12).file(&[])[..20].to_vec()] {
        let source = opened(file().with_sidecar("msk", broken));
        assert!(source.info().warnings[0].contains(".msk beside the file is left out"), "{:?}", source.info().warnings);
    }
    // A mask cut off is void where it is missing.
    let cut = thirds(20, 12).file(&[]);
    let mut source = opened(
        file().with_sidecar("msk", cut.iter().enumerate().map(|(i, &b)| if i == 12 { !b } else { b }).collect()),
    );
    assert!(all(&mut *source, 0).iter().any(|height| height.is_nan()) && !source.info().warnings.is_empty());
}

#[test]
fn gdals_notes_beside_the_file_are_read() {
    let mut maker = Maker::new(8, 6);
    maker.values = (0..48).map(f64::from).collect();
    maker.text(42113, "3");
    let notes = "<PAMDataset><SRS></SRS><GeoTransform>500, 10, 0, 900, 0, -10</GeoTransform>\
        <Metadata><MDI key=\"AREA_OR_POINT\">Point</MDI></Metadata><PAMRasterBand band=\"1\"><NoDataValue>7</NoDataValue>\
        <Scale>2</Scale><Offset>1</Offset><UnitType>cm</UnitType></PAMRasterBand></PAMDataset>";
    let mut source =
        tiff::open_input(Input::memory("made.tif", maker.file(&[])).with_sidecar("aux.xml", notes.as_bytes().to_vec()))
            .expect("opens");
    let height = |value: f64| if value == 7.0 { f64::NAN } else { (value * 2.0 + 1.0) * 0.01 };
    same(&all(&mut *source, 0), maker.values.iter().map(|&value| height(value)));
    let info = source.info();
    assert_eq!(info.georeference.geotransform, [500.0, 10.0, 0.0, 900.0, 0.0, -10.0]);
    assert_eq!((info.nodata, info.georeference.registration), (Some(7.0), littoral_data::Registration::Point));
    assert_eq!(info.warnings, [""; 0]);
    let broken = Input::memory("made.tif", maker.file(&[])).with_sidecar("aux.xml", b"<PAMDataset><".to_vec());
    let mut source = tiff::open_input(broken).expect("opens");
    same(&all(&mut *source, 0), maker.values.iter().map(|&value| if value == 3.0 { f64::NAN } else { value }));
    assert!(source.info().warnings[0].contains("left aside"));
    // On disk they stand behind the whole name; another file's do not count.
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("made.tif"), maker.file(&[])).expect("written");
    std::fs::write(folder.path().join("made.aux.xml"), notes).expect("written");
    let nodata = || littoral_data::open(&folder.path().join("made.tif")).expect("opens").info().nodata;
    assert_eq!(nodata(), Some(3.0));
    std::fs::rename(folder.path().join("made.aux.xml"), folder.path().join("made.tif.aux.xml")).expect("renamed");
    assert_eq!(nodata(), Some(7.0));
}

#[test]
fn no_data_scale_unit_and_place_are_read() {
    let mut maker = Maker::new(8, 6);
    maker.values = (0..48).map(|i| if i == 5 { 999.0 } else { f64::from(i) * 10.0 }).collect();
    maker.text(42113, "999");
    maker.text(
        42112,
        "<GDALMetadata><Item name=\"SCALE\" sample=\"0\" role=\"scale\">2</Item>\
         <Item name=\"OFFSET\" sample=\"0\" role=\"offset\">100</Item>\
         <Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">ft</Item></GDALMetadata>",
    );
    maker.doubles(33550, &[30.0, 20.0, 0.0]);
    maker.doubles(33922, &[0.0, 0.0, 0.0, 500_000.0, 5_000_000.0, 0.0]);
    // Projected, pixel is point, EPSG:32610, heights in NAVD88.
    maker.tag(34735, &[1, 1, 0, 4, 1024, 0, 1, 1, 1025, 0, 1, 2, 3072, 0, 1, 32610, 4096, 0, 1, 5703]);
    let mut source = open(maker.file(&[]));
    let info = source.info().clone();
    assert_eq!(info.georeference.geotransform, [499_985.0, 30.0, 0.0, 5_000_010.0, 0.0, -20.0]);
    assert_eq!(info.georeference.crs.name(), "EPSG:32610");
    assert_eq!(info.vertical_datum, VerticalDatum::Named("EPSG:5703 (NAVD88 height)".into()));
    assert_eq!((info.nodata, info.vertical_metres, info.step), (Some(999.0), 0.3048, 2.0 * 0.3048));
    let heights = all(&mut *source, 0);
    same(&heights, (0..48).map(|i| if i == 5 { f64::NAN } else { (f64::from(i) * 20.0 + 100.0) * 0.3048 }));

    let dem =
        load_from(&mut *source, Path::new("made.tif"), LoadOptions { most_samples: 1000 }, &|_| {}).expect("loads");
    assert_eq!(dem.raster.spacing().to_array(), [30.0, 20.0]);
    assert_eq!(dem.raster.sample(0, 5), Some(heights[0]), "the first row of the file is the northernmost");
    assert_eq!(dem.raster.sample(5, 5), None);
    assert_eq!(dem.raster.voids().count(), 1);
    let first = dem.georeference.local_from_crs().transform_point2(glam::DVec2::new(500_000.0, 5_000_000.0));
    assert!((first - glam::DVec2::new(-105.0, 50.0)).length() < 1e-6);
}

#[test]
fn rotated_and_south_up_grids_stand_upright() {
    let mut maker = Maker::new(6, 4);
    let (sine, cosine) = 0.3f64.sin_cos();
    maker.doubles(
        34264,
        &[
            10.0 * cosine,
            10.0 * sine,
            0.0,
            7.0,
            10.0 * sine,
            -10.0 * cosine,
            0.0,
            9.0,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            1.0,
        ],
    );
    let mut source = open(maker.file(&[]));
    let heights = all(&mut *source, 0);
    let dem = load_from(&mut *source, Path::new("x"), LoadOptions { most_samples: 100 }, &|_| {}).expect("loads");
    assert!((dem.georeference.grid_north() + 0.3).abs() < 1e-12);
    assert_eq!(dem.raster.sample(0, 3), Some(heights[0]));

    let mut maker = Maker::new(6, 4);
    maker.doubles(34264, &[10.0, 0.0, 0.0, 7.0, 0.0, 10.0, 0.0, 9.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    let dem = load_from(&mut *open(maker.file(&[])), Path::new("x"), LoadOptions { most_samples: 100 }, &|_| {})
        .expect("loads");
    assert_eq!(dem.raster.sample(0, 0), Some(maker.values[0] as f32), "the first row of the file is the southernmost");
    // Nothing said: the first row is the north.
    let dem =
        load_from(&mut *open(Maker::new(6, 4).file(&[])), Path::new("x"), LoadOptions { most_samples: 100 }, &|_| {});
    assert_eq!(dem.expect("loads").raster.sample(0, 3), Some(maker.values[0] as f32));
}

#[test]
fn what_is_not_stored_is_void() {
    let mut maker = Maker::new(40, 40);
    (maker.tiled, maker.chunk, maker.sparse) = (true, [16, 16], vec![0, 4]);
    let mut source = open(maker.file(&[]));
    let void = |i: usize| i / 40 < 16 && i % 40 < 16 || (16..32).contains(&(i / 40)) && (16..32).contains(&(i % 40));
    let expected = maker.values.iter().enumerate().map(|(i, value)| if void(i) { f64::NAN } else { *value });
    same(&all(&mut *source, 0), expected);
    all(&mut *source, 0);
    assert_eq!(source.info().warnings, ["2 of 9 chunks are not stored in the file and void"]);
    let survey = survey(&mut *source, &|_| {}).expect("reads");
    assert_eq!((survey.void, survey.first, survey.centre), (512, None, None));
    assert_eq!(survey.last, Some(maker.values[1599] as f32));
    maker.text(42113, "-1");
    let mut source = open(maker.file(&[]));
    all(&mut *source, 0);
    assert_eq!(source.info().warnings, [""; 0], "with a no-data value a missing chunk is nothing unusual");
}

#[test]
fn damage_is_void_and_counted_once() {
    let mut maker = Maker::new(40, 40);
    (maker.tiled, maker.chunk, maker.compression) = (true, [16, 16], 50000);
    let mut bytes = maker.file(&[]);
    bytes[8..24].fill(7); // the first tile begins behind the header
    let mut source = open(bytes);
    for _ in 0..3 {
        let heights = all(&mut *source, 0);
        assert_eq!(heights.iter().filter(|height| height.is_nan()).count(), 256);
    }
    assert_eq!(source.info().warnings.len(), 1);
    assert!(source.info().warnings[0].starts_with("1 of 9 chunks are broken"), "{:?}", source.info().warnings);

    // The last row of an uncompressed file cut off: the directory lies in front of the data in files that stream.
    let mut maker = Maker::new(10, 10);
    maker.chunk = [10, 10];
    let whole = maker.file(&[]);
    let strip = whole.windows(12).position(|w| w[..2] == 279u16.to_le_bytes() && w[2] == 4).expect("byte counts");
    let mut cut = whole.clone();
    cut[strip + 8..strip + 12].copy_from_slice(&189u32.to_le_bytes());
    let mut source = open(cut);
    let heights = all(&mut *source, 0);
    same(&heights[..90], maker.values.iter().copied());
    assert!(heights[90..].iter().all(|height| height.is_nan()));
    assert!(source.info().warnings[0].contains("got 9"), "{:?}", source.info().warnings);
}

#[test]
fn overviews_are_levels_and_fit_what_is_asked_for() {
    let maker = Maker::new(64, 48);
    let mut small = Maker::new(32, 24);
    small.tags.push((254, 4, vec![1, 0, 0, 0], 1));
    let mut tiny = Maker::new(16, 12);
    tiny.tags.push((254, 4, vec![1, 0, 0, 0], 1));
    let mut odd = Maker::new(30, 5); // no smaller version of anything
    odd.tags.push((254, 4, vec![1, 0, 0, 0], 1));
    let mut source = open(maker.file(&[tiny.clone(), odd, small.clone()]));
    let sizes: Vec<[usize; 2]> = source.levels().iter().map(|level| [level.columns, level.rows]).collect();
    assert_eq!(sizes, [[64, 48], [32, 24], [16, 12]]);
    same(&all(&mut *source, 1), small.values.iter().copied());
    let mut load =
        |most_samples| load_from(&mut *source, Path::new("x"), LoadOptions { most_samples }, &|_| {}).expect("loads");
    for (most, columns, rows) in [(5000, 64, 48), (3000, 32, 24), (768, 32, 24), (767, 16, 12), (200, 16, 12)] {
        let dem = load(most);
        assert_eq!([dem.raster.columns(), dem.raster.rows()], [columns, rows], "{most}");
        assert_eq!(dem.raster.spacing().x, 64.0 / columns as f64);
    }
    // Below a quarter of what is wanted no overview serves: the next finer one is averaged down.
    let dem = load(47);
    assert_eq!([dem.raster.columns(), dem.raster.rows()], [7, 5]);
    assert!(dem.info.warnings.iter().any(|warning| warning.contains("averaged down")));
    let mut source = open(maker.file(&[tiny]));
    let dem = load_from(&mut *source, Path::new("x"), LoadOptions { most_samples: 1000 }, &|_| {}).expect("loads");
    assert_eq!([dem.raster.columns(), dem.raster.rows()], [36, 27]);
    let mean = |heights: &mut dyn Iterator<Item = f64>, count: f64| heights.sum::<f64>() / count;
    let coarse = mean(&mut dem.raster.heights().iter().map(|&h| f64::from(h)), 36.0 * 27.0);
    assert!((coarse - mean(&mut maker.values.iter().copied(), 64.0 * 48.0)).abs() < 1e-3, "averages keep the mean");
}

#[test]
fn companions_on_disk_are_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("land.tif");
    std::fs::write(&file, Maker::new(64, 48).file(&[])).expect("written");
    std::fs::write(folder.path().join("land.tif.ovr"), Maker::new(32, 24).file(&[])).expect("written");
    std::fs::write(folder.path().join("land.tfw"), "0.5\n0\n0\n-0.5\n1000.25\n1999.75\n").expect("written");
    let mut source = littoral_data::open(&file).expect("opens");
    assert_eq!(source.levels().len(), 2);
    same(&all(&mut *source, 1), Maker::new(32, 24).values);
    assert_eq!(source.info().georeference.geotransform, [1000.0, 0.5, 0.0, 2000.0, 0.0, -0.5]);
    assert_eq!(source.info().georeference.crs, Crs::Unknown);
    std::fs::write(folder.path().join("land.tif.ovr"), "rubbish").expect("written");
    let source = littoral_data::open(&file).expect("opens all the same");
    assert_eq!((source.levels().len(), source.info().warnings.len()), (1, 1));
}

#[test]
fn windows_load_where_they_lie() {
    let mut maker = Maker::new(20, 10);
    maker.doubles(33550, &[2.0, 2.0, 0.0]);
    maker.doubles(33922, &[0.0, 0.0, 0.0, 100.0, 50.0, 0.0]);
    let mut source = open(maker.file(&[]));
    let window = Window { column: 4, row: 2, columns: 6, rows: 5 };
    let dem = load_window(&mut *source, Path::new("x"), 0, window).expect("loads");
    assert_eq!(dem.raster.sample(0, 4), Some(maker.values[2 * 20 + 4] as f32));
    assert_eq!(dem.georeference.geotransform, [108.0, 2.0, 0.0, 46.0, 0.0, -2.0]);
    for window in
        [Window { columns: 1, ..window }, Window { row: 9, ..window }, Window { column: usize::MAX, ..window }]
    {
        assert!(load_window(&mut *source, Path::new("x"), 0, window).is_err());
    }
    assert!(load_window(&mut *source, Path::new("x"), 1, window).is_err());
}

#[test]
fn threads_do_not_change_the_result() {
    let mut maker = Maker::new(300, 200);
    (maker.kind, maker.tiled, maker.chunk, maker.compression, maker.predictor) = ((3, 32), true, [32, 16], 8, 3);
    let bytes = maker.file(&[]);
    let load = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            load_from(&mut *open(bytes.clone()), Path::new("x"), LoadOptions { most_samples: 7000 }, &|_| {})
        })
    };
    assert_eq!(load(1).expect("loads").raster, load(4).expect("loads").raster);
}

#[test]
fn headers_that_lie_are_refused() {
    let good = Maker::new(16, 16).file(&[]);
    let patched = |tag: u16, value: u32| {
        let mut bytes = good.clone();
        let directory = u32::from_le_bytes([bytes[4], bytes[5], bytes[6], bytes[7]]) as usize;
        let entry = (0..).map(|index| directory + 2 + 12 * index).find(|&at| bytes[at..at + 2] == tag.to_le_bytes());
        let at = entry.expect("the tag") + 8;
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        tiff::open_input(Input::memory("made.tif", bytes)).map(|_| ()).map_err(|error| error.to_string())
    };
    for (tag, value, says) in [
        (256, 0, "at least one sample"),
        (256, u32::MAX, "a size that a raster can have"),
        (256, 1 << 30, "a size that"),
        (257, 1 << 30, "a size that"),
        (257, 4000, "a table of 4"),
        (258, 17, "got 17"),
        (259, 7, "JPEG"),
        (259, 65000, "code 65000"),
        (259, 65000, "gdal_translate -of GTiff -co COMPRESS=DEFLATE"),
        (278, 0, "strips of at least one sample"),
        (339, 5, "complex"),
        (339, 9, "got 9"),
        (284, 3, "planar"),
        (277, 0, "0 bands"),
    ] {
        let error = patched(tag, value).expect_err(says);
        assert!(
            error.contains(says) && error.contains("expected") && error.contains("got"),
            "{tag} = {value}: {error}"
        );
    }
    for cut in 0..good.len() {
        let _ =
            tiff::open_input(Input::memory("made.tif", good[..cut].to_vec())).map(|mut source| all(&mut *source, 0));
    }
}

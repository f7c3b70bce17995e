//! Files in, rasters out: everything of Littoral that touches a disk.
//!
//! [`open`] looks at a file's content (never only at its name), and answers with a [`Source`]: what the file is
//! ([`Info`]), which resolutions it holds, and windows of heights from it. [`load`] goes all the way to a
//! [`littoral::field::Raster`] with a [`Georeference`], at a resolution that fits the memory asked for.
//!
//! ```no_run
//! use littoral::{field::{Land, Water}, picture, picture::{Scene, Settings}, space::Ray};
//! use littoral_data::{LoadOptions, load};
//!
//! let dem = load("dem.tif".as_ref(), LoadOptions { most_samples: 4 << 20 })?;
//! let land = Land::new(dem.raster);
//! let height = land.height_at((250.0, -80.0).into()); // metres, None where void
//! let hit = land.first_hit(&Ray::between((0.0, 0.0, 5e3).into(), (900.0, 0.0, 0.0).into()));
//! let sea = Water::flood(&land, 0.0);
//! let shot = picture::compose(&land, sea.as_ref(), (1280, 720).into());
//! let scene = Scene::for_shot(&land, sea.as_ref(), &shot);
//! let picture = picture::render(&scene, &shot.view, &Settings::default(), &|_| {});
//! # Ok::<(), littoral_data::Error>(())
//! ```
//!
//! Rules that hold for every reader:
//!
//! - A void is told from a height once, here: declared no-data, NaN and infinities, well-known sentinels, and heights
//!   outside −12 000 … 9 000 m (see [`voids`]). Readers hand out `f32` metres with NaN for void.
//! - Sizes are checked against the file's length before any allocation. A broken file gives an [`Error`] that says what
//!   was expected, what was found and what to do, or a partial read with a [`Warning`](Info::warnings); never a panic.
//! - Samples are points. Files that speak of areas are converted once, in [`Georeference`].

mod bytes;
mod crs;
mod drape;
mod error;
pub mod formats;
mod georeference;
mod image;
mod lake;
#[cfg(feature = "lod")]
pub mod lod;
mod mosaic;
mod object;
pub mod path;
mod reduce;
mod source;
mod survey;
pub mod voids;
pub mod waves;
mod wkt;
pub mod write;

pub use crate::image::{BEHIND, Image, image_from, is_picture, open_image};
pub use crs::{Crs, metres_of_unit_name, name_of_unit};
pub use drape::open_drape;
pub use error::Error;
pub use formats::tiles::{Code, Encoding};
pub use georeference::{Georeference, Registration, metres_per_degree};
pub use lake::LakeOrder;
pub use mosaic::{Mosaic, name_of_all, open_all};
pub use object::{ObjectFile, ObjectOrder, object_from, open_object};
pub use source::{
    Dem, Info, Level, LoadOptions, MemorySource, Source, VerticalDatum, load, load_from, load_window, open, open_as,
};
pub use survey::{Survey, survey};

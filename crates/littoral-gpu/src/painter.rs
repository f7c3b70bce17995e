//! Pictures without a window.

use crate::bisector::Bisector;
use crate::coat::PICTURE_BYTES;
use crate::device::{Gpu, GpuError};
use crate::expander::Expander;
use crate::frame::Look;
use crate::objects::TooManyObjects;
use crate::rays::{ShapeError, ShapeTexture};
use crate::renderer::{Ground, Renderer};
use crate::scenery::{Scenery, TooLarge};
use crate::tessellator::{Tessellated, TessellationPasses, Tessellator};
use crate::triangles::{TooMany, Triangles};
use crate::waves::{Waves, WavesError};
use glam::{UVec2, Vec2};
use littoral::field::{HeightField, Land, Sea};
use littoral::lod::{Drawing, Limits, Mesh, NestedBounds, ViewError};
use littoral::picture::{Medium, Picture, Placed, Stage};
use littoral::space::{Datum, View};

/// Paints what views see of a stage, as [`Stage::render_meshes`] does.
#[derive(Debug)]
pub struct Painter {
    gpu: Gpu,
    renderer: Renderer,
    scenery: Scenery,
    triangles: Triangles,
    shape: Option<ShapeTexture>,
    /// Made when the first land is tessellated.
    tessellation: Option<TessellationPasses>,
    /// What made triangles last.
    maker: Option<Maker>,
    white: [f32; 3],
    medium: Medium,
}

/// What makes triangles on the device, with the limits that were asked for.
#[derive(Debug)]
enum Maker {
    Patches(Limits, Tessellator),
    Bisection(Limits, Bisector),
    Drawing(Expander),
}

impl Maker {
    fn triangles(&self) -> &Triangles {
        match self {
            Maker::Patches(_, tessellator) => tessellator.triangles(),
            Maker::Bisection(_, bisector) => bisector.triangles(),
            Maker::Drawing(expander) => expander.triangles(),
        }
    }
}

/// Where the ground of a picture comes from.
enum Source<'a> {
    Mesh(&'a Mesh),
    /// What the device made last.
    Made,
    Rays,
}

/// Why a stage cannot be painted.
#[derive(Debug, thiserror::Error)]
pub enum PainterError {
    /// No device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Too many samples.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
    /// A view of which there is no picture.
    #[error(transparent)]
    View(#[from] ViewError),
    /// Too many triangles.
    #[error(transparent)]
    TooMany(#[from] TooMany),
    /// Too many samples for rays.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// A picture larger than the device's textures.
    #[error(
        "expected a picture of at most {most} pixels a side, which is what this graphics adapter draws, got {got}; draw it smaller, or on the processor"
    )]
    Picture {
        /// Pixels asked for.
        got: UVec2,
        /// Most pixels along a side.
        most: u32,
    },
    /// Waves that it does not draw.
    #[error(transparent)]
    Waves(#[from] WavesError),
    /// Too many objects, or too large ones.
    #[error(transparent)]
    Objects(#[from] TooManyObjects),
    /// Something that it does not draw.
    #[error("expected land on a plane, got {got}: the GPU does not draw that yet; draw it on the processor")]
    Unknown {
        /// What the stage stands on.
        got: &'static str,
    },
}

impl Painter {
    /// A painter of a stage.
    ///
    /// # Errors
    /// If the stage stands on an ellipsoid, or is larger than the device's textures.
    pub fn new(gpu: Gpu, stage: &Stage) -> Result<Painter, PainterError> {
        Painter::with_picture_bytes(gpu, stage, PICTURE_BYTES)
    }

    /// The same where a picture that is laid over the land may take so many bytes of the device (usually 256 MiB): see [`Scenery::with_picture_bytes`].
    ///
    /// # Errors
    /// As [`Painter::new`].
    pub fn with_picture_bytes(gpu: Gpu, stage: &Stage, bytes: u64) -> Result<Painter, PainterError> {
        let Datum::Plane { origin, size } = stage.land().datum() else {
            return Err(PainterError::Unknown { got: "an ellipsoid" });
        };
        let tables = stage.tables();
        let height = f64::from(stage.land().height_range().high).max(2.0);
        let scenery =
            Scenery::with_picture_bytes(&gpu, &tables, (origin, size), (height, &stage.sky_table(height)), bytes)?;
        let renderer = Renderer::new(&gpu, wgpu::TextureFormat::Rgba8Unorm);
        gpu.check()?;
        Ok(Painter {
            gpu,
            renderer,
            scenery,
            triangles: Triangles::default(),
            shape: None,
            tessellation: None,
            maker: None,
            white: tables.white,
            medium: tables.medium,
        })
    }

    /// Draws the waves of a sea where it stands, from here on; or still water.
    ///
    /// # Errors
    /// If the sea is made in ways that the device does not know, or too large for it.
    pub fn set_waves(&mut self, sea: Option<&Sea>) -> Result<(), PainterError> {
        let sea = sea.filter(|_| self.scenery.shows_waves());
        let waves = sea.map(|sea| Waves::new(&self.gpu, sea)).transpose()?.flatten();
        self.scenery.set_waves(waves);
        Ok(self.gpu.check()?)
    }

    /// Goes on to the instant at which the sea of [`Painter::set_waves`] stands now.
    pub fn follow_waves(&mut self, sea: &Sea) {
        self.scenery.follow_waves(&self.gpu, sea);
    }

    /// Draws these objects from here on, in place of those before: [`Stage::placed`].
    ///
    /// # Errors
    /// If they do not fit into the device's buffers, or the device was lost.
    pub fn set_objects(&mut self, placed: &[Placed]) -> Result<(), PainterError> {
        self.scenery.set_objects(&self.gpu, placed)?;
        Ok(self.gpu.check()?)
    }

    /// How many triangles of objects the last picture took, each time that it looked.
    pub fn object_triangles(&self) -> u64 {
        self.renderer.object_triangles()
    }

    /// What paints.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// What a view sees of the stage whose ground is this mesh, or is met by rays, looking through each pixel so many times. `progress` is told the fraction done.
    ///
    /// # Errors
    /// If the picture, the mesh or what rays need is larger than the device's textures or buffers, or the device was lost.
    pub fn picture(
        &mut self,
        stage: &Stage,
        ground: Option<&Mesh>,
        view: &View,
        looks: u32,
        progress: &dyn Fn(f32),
    ) -> Result<Picture, PainterError> {
        self.paint(stage, ground.map_or(Source::Rays, Source::Mesh), view, looks, progress)
    }

    /// Tessellates a land, that of the stage, on the device for the view that is given, which need not be the picture's: see [`Tessellator`]. The first time, and when
    /// limits change, the land is brought to the device.
    ///
    /// # Errors
    /// If the land is larger than the device's textures, the view is not one that a picture can be drawn of, or the device was lost.
    pub fn tessellate(&mut self, land: &Land, limits: Limits, view: &View) -> Result<Tessellated, PainterError> {
        let mut tessellator = match self.maker.take() {
            Some(Maker::Patches(kept, tessellator)) if kept == limits => tessellator,
            _ => {
                let passes = self.tessellation.get_or_insert_with(|| TessellationPasses::new(&self.gpu));
                Tessellator::new(&self.gpu, passes, land, limits)?
            }
        };
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        tessellator.tessellate(&self.gpu, &mut encoder, view, None)?;
        self.gpu.queue.submit([encoder.finish()]);
        let told = tessellator.read(&self.gpu)?;
        self.maker = Some(Maker::Patches(limits, tessellator));
        Ok(told)
    }

    /// The same by bisection, which goes on from what was drawn before: see [`Bisector`].
    ///
    /// # Errors
    /// As there.
    pub fn bisect(&mut self, bounds: &NestedBounds, limits: Limits, view: &View) -> Result<Tessellated, PainterError> {
        let mut bisector = match self.maker.take() {
            Some(Maker::Bisection(kept, bisector)) if kept == limits => bisector,
            _ => Bisector::new(&self.gpu, bounds, limits)?,
        };
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        bisector.bisect(&self.gpu, &mut encoder, view, None)?;
        self.gpu.queue.submit([encoder.finish()]);
        let told = bisector.read(&self.gpu)?;
        self.maker = Some(Maker::Bisection(limits, bisector));
        Ok(told)
    }

    /// Turns what a method drew of a land, that of the stage, into triangles on the device: see [`Expander`]. Returns how many there are.
    ///
    /// # Errors
    /// If the land or the drawing is larger than the device's textures or buffers, or the device was lost.
    pub fn expand(&mut self, land: &Land, drawing: &mut Drawing) -> Result<usize, PainterError> {
        let mut expander = match self.maker.take() {
            Some(Maker::Drawing(expander)) => expander,
            _ => Expander::new(&self.gpu, land)?,
        };
        expander.expand(&self.gpu, drawing)?;
        let count = expander.count(&self.gpu)?;
        self.maker = Some(Maker::Drawing(expander));
        Ok(count as usize)
    }

    /// The same as [`Painter::picture`], the ground being the triangles that the device made last.
    ///
    /// # Errors
    /// As there.
    pub fn picture_of_made(
        &mut self,
        stage: &Stage,
        view: &View,
        looks: u32,
        progress: &dyn Fn(f32),
    ) -> Result<Picture, PainterError> {
        self.paint(stage, Source::Made, view, looks, progress)
    }

    fn paint(
        &mut self,
        stage: &Stage,
        source: Source,
        view: &View,
        looks: u32,
        progress: &dyn Fn(f32),
    ) -> Result<Picture, PainterError> {
        let gpu = &self.gpu;
        let most = gpu.device.limits().max_texture_dimension_2d;
        if view.size.max_element() > most {
            return Err(PainterError::Picture { got: view.size, most });
        }
        if view.size.min_element() == 0 {
            return Ok(Picture::empty(view.size, view.eye));
        }
        if self.scenery.wants_sky(view.eye.z) {
            self.scenery.set_sky(gpu, view.eye.z, &stage.sky_table(view.eye.z));
        }
        self.scenery.bring_picture(gpu, stage, view, usize::MAX);
        let ground = match source {
            Source::Mesh(mesh) => {
                self.triangles.set(gpu, mesh)?;
                Ground::Triangles(&self.triangles)
            }
            Source::Made => Ground::Triangles(self.maker.as_ref().map_or(&self.triangles, Maker::triangles)),
            Source::Rays => {
                let shape = match self.shape.take() {
                    Some(shape) => shape,
                    None => ShapeTexture::new(gpu, stage.land())?,
                };
                Ground::Rays { shape: self.shape.insert(shape), pixels: 0.0 }
            }
        };
        let looks = looks.max(1);
        let share = 1.0 / looks as f32;
        let mut picture = Picture::empty(view.size, view.eye);
        picture.white = self.white;
        picture.medium = self.medium;
        let (corner, right, down) = view.frame();
        let width = view.size.x as usize;
        for number in 0..looks {
            // The first through the middle; all together evenly over the pixel (M. Roberts's R2 sequence, 2018).
            let offset = (Vec2::new(0.754_877_7, 0.569_840_3) * number as f32 + 0.5).fract() - 0.5;
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            self.renderer.draw(gpu, &mut encoder, &self.scenery, ground, view, Look { offset, number });
            gpu.queue.submit([encoder.finish()]);
            for (i, [red, green, blue, distance]) in self.renderer.read(gpu)?.into_iter().enumerate() {
                for (sum, seen) in picture.radiance[i].iter_mut().zip([red, green, blue]) {
                    *sum += seen * share;
                }
                if distance > 0.0 {
                    picture.coverage[i] += share;
                }
                if number == 0 && distance > 0.0 {
                    let (x, y) = ((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
                    let position = (corner + right * x + down * y).normalize() * distance;
                    picture.depth[i] = distance;
                    picture.position[i] = position.to_array();
                    picture.height[i] = (view.eye.z + f64::from(position.z)) as f32;
                }
            }
            progress((number + 1) as f32 * share);
        }
        Ok(picture)
    }
}

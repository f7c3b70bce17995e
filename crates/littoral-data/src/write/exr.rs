//! OpenEXR pictures: linear light and the numbers behind it, 32-bit floating point.
//!
//! All layers share one part, their channels named `layer.channel` (the convention of OpenEXR's own documentation), which
//! Blender, Nuke, Krita and oiiotool all take apart again; several parts are read by fewer programs.

use super::whole;
use crate::Error;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer as ExrLayer, LayerAttributes, Text, WritableImage,
};
use std::path::Path;

/// A plane or more of numbers, one a pixel each, row by row from the top.
#[derive(Clone, Debug)]
pub struct Layer {
    /// The layer's name; empty for the main picture.
    pub name: &'static str,
    /// Channels by name: `R`, `G`, `B`; `X`, `Y`, `Z`; `V` for a single number.
    pub channels: Vec<(&'static str, Vec<f32>)>,
}

/// Writes layers of `width` × `height` pixels into one file, losslessly compressed.
///
/// # Errors
/// If the system refuses.
///
/// # Panics
/// If a channel has not `width × height` numbers.
pub fn exr(file: &Path, width: u32, height: u32, layers: Vec<Layer>, comment: &str) -> Result<(), Error> {
    let size = (width as usize, height as usize);
    let mut channels = Vec::new();
    for layer in layers {
        for (channel, numbers) in layer.channels {
            assert_eq!(
                numbers.len(),
                size.0 * size.1,
                "expected {width} × {height} numbers in {}.{channel}",
                layer.name
            );
            let name = if layer.name.is_empty() { channel.to_owned() } else { format!("{}.{channel}", layer.name) };
            channels.push(AnyChannel::new(name.as_str(), FlatSamples::F32(numbers)));
        }
    }
    let attributes = LayerAttributes {
        software_name: Some(Text::from("littoral")),
        comments: Text::new_or_none(comment),
        ..LayerAttributes::default()
    };
    let channels = AnyChannels::sort(channels.into());
    let image = Image::from_layer(ExrLayer::new(size, attributes, Encoding::SMALL_LOSSLESS, channels));
    whole(file, |sink| image.write().to_buffered(sink).map_err(std::io::Error::other))
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::{ReadChannels, ReadLayers, read};

    #[test]
    fn layers_come_back_by_name() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("p.exr");
        let numbers = |k: f32| (0..15).map(|i| i as f32 * k).collect::<Vec<_>>();
        let layers = vec![
            Layer { name: "", channels: vec![("R", numbers(1.0)), ("G", numbers(-2.5)), ("B", numbers(1e9))] },
            Layer { name: "depth", channels: vec![("V", vec![f32::INFINITY; 15])] },
        ];
        exr(&file, 5, 3, layers, "a note").expect("written");
        let image =
            read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
        let image = image.from_file(&file).expect("an EXR");
        let layer = image.layer_data;
        let names: Vec<String> = layer.channel_data.list.iter().map(|c| c.name.to_string()).collect();
        assert_eq!(names, ["B", "G", "R", "depth.V"]);
        let values = |i: usize| layer.channel_data.list[i].sample_data.values_as_f32().collect::<Vec<f32>>();
        assert_eq!(values(1), numbers(-2.5));
        assert!(values(3).iter().all(|v| *v == f32::INFINITY));
    }
}

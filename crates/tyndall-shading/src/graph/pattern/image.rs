//! An image on the surface (UsdUVTexture).

use super::Pattern;
use crate::KindSpec;
use crate::graph::inputs::Inputs;
use crate::graph::{Operand, ShadingContext, Value};
use crate::kind::{ANY, ParamSpec};
use crate::texture::{Texture, Wrap};
use glam::Vec2;
use std::path::Path;
use tyndall_scene::ColorSpace;

const WRAPS: &str = "black|clamp|repeat|mirror|useMetadata";

#[derive(Debug, Clone)]
pub(in crate::graph) struct Image {
    /// `None` if the file cannot be used.
    texture: Option<Texture>,
    st: Operand,
    scale: Value,
    bias: Value,
    fallback: Operand,
}

impl Image {
    fn texture(inputs: &mut Inputs) -> Option<Texture> {
        let color_space = match inputs.choice("color_space") {
            "sRGB" => ColorSpace::Srgb,
            "raw" => ColorSpace::Raw,
            _ => ColorSpace::Auto,
        };
        let file = inputs.text("file").to_owned();
        if file.is_empty() {
            inputs.warn("file", "is not set", "the fallback value was used; name an image");
            return None;
        }
        let wrap = |name: &str| Wrap::from_name(name).unwrap_or_default();
        let (wrap_s, wrap_t) = (wrap(inputs.choice("wrap_s")), wrap(inputs.choice("wrap_t")));
        match inputs.assets().image(Path::new(&file), color_space) {
            Ok(image)
                if image.width * image.height == 0 || image.pixels.len() != image.width * image.height =>
            {
                inputs.error("file", &format!("{file} has no pixels"), "the fallback value was used");
                None
            }
            Ok(image) => Some(Texture::new(image, wrap_s, wrap_t)),
            Err(error) => {
                inputs.error("file", &error.message, "the fallback value was used");
                None
            }
        }
    }

    /// A constant of three channels and its alpha.
    fn constant(inputs: &mut Inputs, name: &str, alpha: &str) -> Value {
        let [r, g, b, _] = inputs.constant(name);
        [r, g, b, inputs.constant(alpha)[0]]
    }
}

impl Pattern for Image {
    const KIND: KindSpec = KindSpec {
        name: "image",
        doc: "An image on the surface: texel * scale + bias.",
        params: &[
            ParamSpec::text("file", "", "", "The image file."),
            ParamSpec::vector(
                "st",
                [0.0; 3],
                ANY,
                "",
                "Texture coordinates, origin bottom left; unless authored the primvar st.",
            ),
            ParamSpec::text("wrap_s", "useMetadata", WRAPS, "What lies left and right of the image."),
            ParamSpec::text("wrap_t", "useMetadata", WRAPS, "What lies above and below the image."),
            ParamSpec::vector("scale", [1.0; 3], ANY, "", "Factor on red, green and blue."),
            ParamSpec::float("scale_a", 1.0, ANY, "", "Factor on alpha."),
            ParamSpec::vector("bias", [0.0; 3], ANY, "", "Added to red, green and blue."),
            ParamSpec::float("bias_a", 0.0, ANY, "", "Added to alpha."),
            ParamSpec::vector("fallback", [0.0; 3], ANY, "", "Value if the file cannot be read."),
            ParamSpec::text("color_space", "auto", "auto|sRGB|raw", "How the numbers in the file are meant."),
        ],
    };
    const IS_VARYING: bool = true;

    fn build(inputs: &mut Inputs) -> Self {
        Self {
            texture: Self::texture(inputs),
            st: if inputs.is_authored("st") { inputs.operand("st") } else { inputs.primvar("st") },
            scale: Self::constant(inputs, "scale", "scale_a"),
            bias: Self::constant(inputs, "bias", "bias_a"),
            fallback: inputs.operand("fallback"),
        }
    }

    fn operands(&self) -> Vec<Operand> {
        vec![self.st, self.fallback]
    }

    fn evaluate(&self, registers: &[Value], _: &dyn ShadingContext) -> Value {
        let Some(texture) = &self.texture else { return self.fallback.value(registers) };
        let [s, t, ..] = self.st.value(registers);
        let texel = texture.lookup(Vec2::new(s, t));
        std::array::from_fn(|i| texel[i] * self.scale[i] + self.bias[i])
    }
}

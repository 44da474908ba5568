"""The one table of source nodes: id, or the start of an id ending in ``_``, to converter."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tyndall_usd.shading import foreign_medium, materialx, medium, preview, procedural, uber

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tyndall_usd.shading.network import Converted, ShaderNode

CONVERTERS: Mapping[str, Callable[[ShaderNode], Converted | None]] = {
    "UsdPreviewSurface": preview.convert_preview_surface,
    "UsdUVTexture": preview.convert_uv_texture,
    "UsdPrimvarReader_": preview.convert_primvar_reader,
    "UsdTransform2d": preview.convert_transform_2d,
    "ND_UsdPreviewSurface_surfaceshader": preview.convert_preview_surface,
    "ND_UsdUVTexture": preview.convert_uv_texture,
    "ND_UsdUVTexture_": preview.convert_uv_texture,
    "ND_UsdPrimvarReader_": preview.convert_primvar_reader,
    "ND_UsdTransform2d": preview.convert_transform_2d,
    "ND_surface": materialx.convert_surface,
    "ND_oren_nayar_diffuse_bsdf": materialx.convert_diffuse,
    "ND_burley_diffuse_bsdf": materialx.convert_diffuse,
    "ND_dielectric_bsdf": materialx.convert_dielectric,
    "ND_conductor_bsdf": materialx.convert_conductor,
    "ND_mix_bsdf": materialx.convert_mix_closure,
    "ND_layer_bsdf": materialx.convert_layer,
    "ND_uniform_edf": materialx.convert_edf,
    "ND_geompropvalue_": materialx.convert_geomprop,
    "ND_texcoord_": materialx.convert_texcoord,
    "ND_image_": materialx.convert_image,
    "ND_tiledimage_": materialx.convert_image,
    "ND_constant_": materialx.convert_constant,
    "ND_convert_": materialx.convert_constant,
    "ND_dot_": materialx.convert_constant,
    "ND_multiply_": materialx.binary("multiply", 1.0),
    "ND_add_": materialx.binary("add", 0.0),
    "ND_subtract_": materialx.binary("subtract", 0.0),
    "ND_mix_": materialx.convert_mix,
    "ND_blackbody": materialx.convert_blackbody,
    "ND_clamp_": materialx.convert_clamp,
    "ND_extract_": materialx.convert_extract,
    "ND_position_vector3": procedural.convert_position,
    "ND_noise2d_float": procedural.convert_noise,
    "ND_noise3d_float": procedural.convert_noise,
    "ND_fractal2d_float": procedural.convert_fractal,
    "ND_fractal3d_float": procedural.convert_fractal,
    "ND_combine3_": procedural.convert_combine,
    "ND_remap_": procedural.convert_remap,
    "ND_smoothstep_": procedural.convert_smoothstep,
    "ND_divide_": procedural.function("divide", "in1", "in2", defaults=(0.0, 1.0)),
    "ND_modulo_": procedural.function("floored_modulo", "in1", "in2", defaults=(0.0, 1.0)),
    "ND_power_": procedural.function("power", "in1", "in2", defaults=(0.0, 1.0)),
    "ND_min_": procedural.function("minimum", "in1", "in2"),
    "ND_max_": procedural.function("maximum", "in1", "in2"),
    "ND_absval_": procedural.function("absolute", "in"),
    "ND_sign_": procedural.function("sign", "in"),
    "ND_floor_": procedural.function("floor", "in"),
    "ND_ceil_": procedural.function("ceil", "in"),
    "ND_round_": procedural.function("round", "in"),
    "ND_sqrt_": procedural.function("sqrt", "in"),
    "ND_exp_": procedural.function("exponent", "in"),
    "ND_sin_": procedural.function("sine", "in"),
    "ND_cos_": procedural.function("cosine", "in"),
    "ND_dotproduct_": procedural.vector_function("dot", "in1", "in2"),
    "ND_crossproduct_": procedural.vector_function("cross", "in1", "in2"),
    "ND_magnitude_": procedural.vector_function("length", "in"),
    "ND_normalize_": procedural.vector_function("normalize", "in"),
    "ND_normalmap": materialx.convert_normal_map,
    "ND_normalmap_": materialx.convert_normal_map,
    "ND_standard_surface_surfaceshader": uber.convert_standard_surface,
    "ND_open_pbr_surface_surfaceshader": uber.convert_open_pbr,
    "ND_gltf_pbr_surfaceshader": uber.convert_gltf_pbr,
    "ND_volume": medium.convert_volume,
    "ND_anisotropic_vdf": medium.convert_anisotropic_vdf,
    "ND_absorption_vdf": medium.convert_absorption_vdf,
    "ND_multiply_vdfF": medium.convert_multiply_vdf,
    "ND_multiply_vdfC": medium.convert_multiply_vdf,
    "ND_add_vdf": medium.convert_first_vdf,
    "ND_mix_vdf": medium.convert_first_vdf,
    "tyndall:volume": medium.convert_own_volume,
    "kma_volume": foreign_medium.convert_karma_volume,
    "arnold:standard_volume": foreign_medium.convert_arnold_volume,
    "standard_volume": foreign_medium.convert_arnold_volume,
    "PxrVolume": foreign_medium.convert_renderman_volume,
    "cycles_principled_volume": foreign_medium.convert_cycles_volume,
    "principled_volume": foreign_medium.convert_cycles_volume,
}

#: Render contexts whose terminals are read, best first.
SURFACE_CONTEXTS = ("mtlx", "")
VOLUME_CONTEXTS = ("mtlx", "", "kma", "karma", "arnold", "ri", "cycles")

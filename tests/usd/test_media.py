"""Volume shaders: our own, MaterialX's emission, and what is understood of other renderers' ones."""

from __future__ import annotations

import math

import pytest
from pxr import Sdf
from usd.test_material import Look, volume_of

T = Sdf.ValueTypeNames


def read(look: Look):
    """Return the inputs of the medium and the translation; what is bound to a cube, without a surface."""
    translation = look.read()
    kind, inputs = volume_of(translation.prims["/look"])
    assert kind == "volume"
    return inputs, translation


def single(node_id, **inputs):
    """Return a look whose volume is one shader."""
    look = Look()
    look.volume(look.node("v", node_id, **inputs))
    return look


def reader(look: Look, name: str):
    """Return a shader that reads a field."""
    return look.node(name, "ND_geompropvalue_float", geomprop=(T.String, name))


def field(name):
    return "field", {"name": name}


def times(factor, name):
    return "multiply", {"in1": pytest.approx(factor), "in2": field(name)}


def test_own_volume_by_its_inputs():
    look = Look()
    density, heat, flame = (reader(look, name) for name in ("density", "heat", "flame"))
    kelvin = look.node("k", "ND_multiply_float", in1=(T.Float, 2000), in2=(T.Float, heat, "out"))
    glow = look.node("g", "ND_multiply_color3FA", in1=(T.Color3f, (2, 1, 0)), in2=(T.Float, flame, "out"))
    look.volume(
        look.node(
            "v",
            "tyndall:volume",
            density=(T.Float, density, "out"),
            albedo=(T.Color3f, (0.75, 0.5, 0.25)),
            anisotropy=(T.Float, 0.75),
            anisotropy2=(T.Float, -0.25),
            lobeMix=(T.Float, 0.125),
            emission=(T.Color3f, glow, "out"),
            temperature=(T.Float, kelvin, "out"),
            blackbodyIntensity=(T.Color3f, (1, 0.5, 0.25)),
        )
    )
    inputs, translation = read(look)
    assert inputs == {
        "absorption": times((0.25, 0.5, 0.75), "density"),
        "scattering": times((0.75, 0.5, 0.25), "density"),
        "anisotropy": 0.75,
        "anisotropy2": -0.25,
        "lobeMix": 0.125,
        "emission": times((2, 1, 0), "flame"),
        "temperature": times((2000, 2000, 2000), "heat"),
        "blackbodyIntensity": (1, 0.5, 0.25),
    }
    assert not translation.messages


@pytest.mark.parametrize(
    ("authored", "expected"),
    [
        ({"phase": (T.Token, "rayleigh")}, {"phase": "rayleigh"}),
        (
            {"phase": (T.Token, "droplets"), "dropletDiameter": (T.Float, 8)},
            {"phase": "droplets", "dropletDiameter": 8},
        ),
        (
            {"phase": (T.Token, "draine"), "anisotropy": (T.Float, 0.5), "alpha": (T.Float, 30)},
            {"phase": "draine", "anisotropy": 0.5, "alpha": 30},
        ),
    ],
)
def test_own_volume_has_phase_functions(authored, expected):
    inputs, translation = read(single("tyndall:volume", density=(T.Float, 2), **authored))
    assert inputs == {"absorption": (1, 1, 1), "scattering": (1, 1, 1), **expected}
    assert not translation.messages


def test_own_volume_names_what_it_does_not_know():
    _, translation = read(single("tyndall:volume", density=(T.Float, 1), colour=(T.Color3f, (1, 0, 0))))
    assert translation.said("/look/v", "colour")


def test_emission_may_be_a_sum_of_fields():
    look = Look()
    both = look.node(
        "sum",
        "ND_add_color3",
        in1=(T.Color3f, reader(look, "fire"), "out"),
        in2=(T.Color3f, reader(look, "sparks"), "out"),
    )
    edf = look.node("edf", "ND_uniform_edf", color=(T.Color3f, both, "out"))
    look.volume(look.node("v", "ND_volume", edf=(T.Token, edf, "out")), "mtlx")
    inputs, translation = read(look)
    assert inputs["emission"] == ("add", {"in1": field("fire"), "in2": field("sparks")})
    assert not translation.messages


def test_materialx_blackbody_is_a_colour():
    look = Look()
    hot = look.node("hot", "ND_blackbody", temperature=(T.Float, 3000))
    glow = look.node(
        "g", "ND_multiply_color3FA", in1=(T.Color3f, hot, "out"), in2=(T.Float, reader(look, "flame"), "out")
    )
    edf = look.node("edf", "ND_uniform_edf", color=(T.Color3f, glow, "out"))
    vdf = look.node("vdf", "ND_absorption_vdf", absorption=(T.Float3, (1, 1, 1)))
    look.volume(look.node("v", "ND_volume", vdf=(T.Token, vdf, "out"), edf=(T.Token, edf, "out")), "mtlx")
    inputs, translation = read(look)
    assert inputs["emission"] == (
        "multiply",
        {"in1": ("blackbody", {"temperature": 3000}), "in2": field("flame")},
    )
    assert not translation.messages


def test_distributions_times_a_field():
    look = Look()
    vdf = look.node("vdf", "ND_anisotropic_vdf", scattering=(T.Float3, (1, 2, 3)), anisotropy=(T.Float, 0.5))
    scaled = look.node(
        "m", "ND_multiply_vdfF", in1=(T.Token, vdf, "out"), in2=(T.Float, reader(look, "smoke"), "out")
    )
    look.volume(look.node("v", "ND_volume", vdf=(T.Token, scaled, "out")), "mtlx")
    inputs, _ = read(look)
    assert inputs["scattering"] == times((1, 2, 3), "smoke")
    assert inputs["anisotropy"] == 0.5


def test_combined_distributions_keep_the_first():
    look = Look()
    a = look.node("a", "ND_anisotropic_vdf", scattering=(T.Float3, (1, 2, 3)))
    b = look.node("b", "ND_absorption_vdf", absorption=(T.Float3, (1, 1, 1)))
    both = look.node("ab", "ND_add_vdf", in1=(T.Token, a, "out"), in2=(T.Token, b, "out"))
    look.volume(look.node("v", "ND_volume", vdf=(T.Token, both, "out")), "mtlx")
    inputs, translation = read(look)
    assert inputs["scattering"] == (1, 2, 3)
    assert translation.said("/look/ab", "first")


def test_karma_volume_has_two_lobes():
    look = single(
        "kma_volume",
        absorption=(T.Float3, (0, 0, 1)),
        scattering=(T.Float3, (1, 2, 3)),
        anisotropy=(T.Float, 0.75),
        secondaryanisotropy=(T.Float, -0.5),
        secondarymix=(T.Float, 0.25),
        emission=(T.Color3f, (1, 1, 0)),
        extinctionmodifier=(T.Float, 2),
    )
    inputs, translation = read(look)
    assert inputs == {
        "absorption": (0, 0, 1),
        "scattering": (1, 2, 3),
        "anisotropy": 0.75,
        "anisotropy2": -0.5,
        "lobeMix": 0.25,
        "emission": (1, 1, 0),
    }
    assert translation.said("/look/v", "ignored inputs: extinctionmodifier")


ARNOLD = {
    "density": (T.Float, 2),
    "density_channel": (T.String, "smoke"),
    "scatter_color": (T.Color3f, (1, 0.5, 0)),
    "transparent_depth": (T.Float, 0.5),
    "scatter_anisotropy": (T.Float, 0.75),
    "scatter_secondary_anisotropy": (T.Float, -0.5),
    "scatter_secondary_anisotropy_mix": (T.Float, 0.25),
    "emission": (T.Float, 0.5),
    "emission_color": (T.Color3f, (1, 0.5, 0.25)),
    "blackbody_kelvin": (T.Float, 1000),
    "temperature": (T.Float, 2),
    "temperature_channel": (T.String, "heat"),
}


def test_arnold_volume():
    inputs, translation = read(
        single("arnold:standard_volume", **ARNOLD, scatter_color_channel=(T.String, "Cd"))
    )
    extinction = 2 * -math.log(math.exp(-1)) / 0.5
    assert inputs["scattering"] == times((extinction, 0.5 * extinction, 0), "smoke")
    assert (inputs["anisotropy"], inputs["anisotropy2"], inputs["lobeMix"]) == (0.75, -0.5, 0.25)
    assert inputs["temperature"] == times((2000, 2000, 2000), "heat")
    assert inputs["blackbodyIntensity"] == (0.5, 0.25, 0.125)
    assert "emission" not in inputs
    assert translation.said("/look/v", "ignored inputs: scatter_color_channel")


@pytest.mark.parametrize(
    ("mode", "emission"),
    [
        ("none", None),
        ("density", times((0.5, 0.25, 0.125), "smoke")),
        ("channel", times((0.5, 0.25, 0.125), "heat")),
    ],
)
def test_arnold_emission_modes(mode, emission):
    inputs, _ = read(single("standard_volume", **ARNOLD, emission_mode=(T.Token, mode)))
    assert inputs.get("emission") == emission
    assert "temperature" not in inputs


def test_renderman_volume():
    look = single(
        "PxrVolume",
        densityFloat=(T.Float, 3),
        densityFloatPrimVar=(T.String, "density"),
        diffuseColor=(T.Color3f, (1, 0.5, 0)),
        emitColor=(T.Color3f, (0, 0, 2)),
        anisotropy=(T.Float, 0.75),
        anisotropySecondary=(T.Float, -0.5),
        anisotropyBlend=(T.Float, 0.25),
        extinctionMultiplier=(T.Float, 0.5),
    )
    inputs, translation = read(look)
    # A primvar takes the place of the number.
    assert inputs["scattering"] == times((1, 0.5, 0), "density")
    assert inputs["absorption"] == times((0, 0.5, 1), "density")
    assert (inputs["anisotropy2"], inputs["lobeMix"], inputs["emission"]) == (-0.5, 0.25, (0, 0, 2))
    assert translation.said("/look/v", "ignored inputs: extinctionMultiplier")
    inputs, _ = read(single("PxrVolume", densityColor=(T.Color3f, (1, 2, 3))))
    assert inputs["scattering"] == (1, 2, 3)
    inputs, _ = read(single("PxrVolume", extinctionDistance=(T.Float, 4)))
    assert inputs["scattering"] == (0.25, 0.25, 0.25)


def test_cycles_volume():
    look = single(
        "cycles_principled_volume",
        density=(T.Float, 2),
        color=(T.Color3f, (0.75, 0.5, 0)),
        absorption_color=(T.Color3f, (0, 0.25, 1)),
        emission_strength=(T.Float, 2),
        emission_color=(T.Color3f, (1, 0.5, 0)),
        blackbody_intensity=(T.Float, 0.5),
        blackbody_tint=(T.Color3f, (1, 1, 0.5)),
        temperature=(T.Float, 1500),
        color_attribute=(T.String, "Cd"),
    )
    inputs, translation = read(look)
    assert inputs["scattering"] == times((1.5, 1, 0), "density")
    assert inputs["absorption"] == times((0.5, 0.5, 0), "density")
    assert inputs["emission"] == (2, 1, 0)
    assert inputs["temperature"] == times((1500, 1500, 1500), "temperature")
    assert inputs["blackbodyIntensity"] == (0.5, 0.5, 0.25)
    assert translation.said("/look/v", "ignored inputs: color_attribute")


def test_cycles_volume_is_dark_by_default():
    inputs, translation = read(single("principled_volume"))
    assert "temperature" not in inputs
    assert "emission" not in inputs
    assert not translation.messages

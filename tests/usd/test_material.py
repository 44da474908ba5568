"""Materials: terminals, bindings, node networks and fallbacks."""

from __future__ import annotations

import pytest
import tyndall_usd
from pxr import Sdf, Usd, UsdGeom, UsdShade
from support.shared import shared
from tyndall.prims import Material, NodeRef
from tyndall_usd.materials import DISPLAY_COLOR, DISPLAY_COLOR_OPACITY
from usd.collector import translate

T = Sdf.ValueTypeNames


class Look:
    """A material under construction, bound to a cube at /cube."""

    def __init__(self):
        self.stage = Usd.Stage.CreateInMemory()
        self.cube = UsdGeom.Cube.Define(self.stage, "/cube").GetPrim()
        self.material = UsdShade.Material.Define(self.stage, "/look")
        UsdShade.MaterialBindingAPI.Apply(self.cube).Bind(self.material)

    def node(self, name, node_id, **inputs):
        """Add a shader; inputs are (type, value) or (type, shader, output)."""
        shader = UsdShade.Shader.Define(self.stage, f"/look/{name}")
        shader.CreateIdAttr(node_id)
        for key, (kind, *value) in inputs.items():
            target = shader.CreateInput(key, kind)
            if len(value) == 2:
                target.ConnectToSource(value[0].ConnectableAPI(), value[1])
            else:
                target.Set(value[0])
        return shader

    def surface(self, shader, context="", output="surface"):
        self.material.CreateSurfaceOutput(context).ConnectToSource(shader.ConnectableAPI(), output)

    def volume(self, shader, context="", output="out"):
        self.material.CreateVolumeOutput(context).ConnectToSource(shader.ConnectableAPI(), output)

    def read(self):
        return translate(self.stage)

    def translated(self) -> Material:
        return self.read().prims["/look"]


def resolve(material: Material, value):
    """Return an input with nodes written out as (kind, {inputs})."""
    if isinstance(value, NodeRef):
        node = material.nodes[value.index]
        assert all(not isinstance(v, NodeRef) or v.index < value.index for v in node.inputs.values())
        return node.kind, {name: resolve(material, v) for name, v in node.inputs.items()}
    return value


def surface_of(material):
    return resolve(material, NodeRef(material.surface))


def volume_of(material):
    return resolve(material, NodeRef(material.volume))


def test_unbound_prims_show_their_display_color_or_grey():
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.Cube.Define(stage, "/a")
    UsdGeom.Cube.Define(stage, "/b").CreateDisplayOpacityPrimvar("constant").Set([0.5])
    read = translate(stage)
    assert read.prims["/a"].material == DISPLAY_COLOR
    grey = pytest.approx((0.18, 0.18, 0.18))
    kind, inputs = surface_of(read.prims[DISPLAY_COLOR])
    assert (kind, inputs["color"]) == ("diffuse", ("primvar", {"name": "displayColor", "default": grey}))
    assert read.prims["/b"].material == DISPLAY_COLOR_OPACITY
    assert read.prims["/b"].primvars["displayOpacity"].values.tolist() == [[0.5]]
    assert not read.messages


def test_the_mtlx_terminal_wins():
    look = Look()
    look.surface(look.node("preview", "UsdPreviewSurface"))
    bsdf = look.node(
        "bsdf", "ND_oren_nayar_diffuse_bsdf", color=(T.Color3f, (0.5, 0.25, 0)), roughness=(T.Float, 0)
    )
    look.surface(look.node("surface", "ND_surface", bsdf=(T.Token, bsdf, "out")), "mtlx", "out")
    kind, inputs = surface_of(look.translated())
    assert kind == "surface"
    assert inputs["bsdf"] == ("diffuse", {"color": (0.5, 0.25, 0.0), "roughness": 0.0})


def test_an_unknown_mtlx_terminal_leaves_the_universal_one():
    look = Look()
    look.surface(look.node("preview", "UsdPreviewSurface", roughness=(T.Float, 0.25)))
    look.surface(look.node("odd", "ND_from_the_future"), "mtlx", "out")
    assert surface_of(look.translated()) == ("preview_surface", {"roughness": 0.25})


def test_preview_surface_with_textures():
    look = Look()
    image = shared("data", "usd_wg", "test_assets", "TextureTransformTest", "TextureTransformTest.usd")
    reader = look.node("st", "UsdPrimvarReader_float2", varname=(T.String, "uv"))
    turned = look.node(
        "turn",
        "UsdTransform2d",
        **{"in": (T.Float2, reader, "result")},
        rotation=(T.Float, 90),
        scale=(T.Float2, (2, 3)),
    )
    texture = look.node(
        "texture",
        "UsdUVTexture",
        file=(T.Asset, str(image)),
        st=(T.Float2, turned, "result"),
        wrapS=(T.Token, "repeat"),
        scale=(T.Float4, (2, 2, 2, 0.5)),
        bias=(T.Float4, (-1, -1, -1, 0)),
        sourceColorSpace=(T.Token, "raw"),
    )
    look.surface(
        look.node(
            "surface",
            "UsdPreviewSurface",
            diffuseColor=(T.Color3f, texture, "rgb"),
            opacity=(T.Float, texture, "a"),
            metallic=(T.Float, 1),
        )
    )
    read = look.read()
    kind, inputs = surface_of(read.prims["/look"])
    assert kind == "preview_surface"
    assert inputs["metallic"] == 1.0
    name, picture = inputs["diffuseColor"]
    assert name == "image"
    assert picture["file"] == str(image)
    assert (picture["wrap_s"], picture["wrap_t"]) == ("repeat", "useMetadata")
    assert (picture["scale"], picture["scale_a"], picture["bias"]) == ((2, 2, 2), 0.5, (-1, -1, -1))
    assert picture["color_space"] == "raw"
    assert picture["st"][0] == "transform2d"
    assert picture["st"][1]["scale"] == (2, 3, 0)
    assert picture["st"][1]["in"] == ("primvar", {"name": "uv"})
    assert inputs["opacity"] == ("channel", {"channel": "a", "in": inputs["diffuseColor"]})
    assert len([n for n in read.prims["/look"].nodes if n.kind == "image"]) == 1, "one node for both outputs"


def test_a_missing_texture_shows_its_fallback():
    look = Look()
    texture = look.node("t", "UsdUVTexture", file=(T.Asset, "/no.png"), fallback=(T.Float4, (1, 0, 0.5, 1)))
    surface = look.node("s", "UsdPreviewSurface", diffuseColor=(T.Color3f, texture, "rgb"))
    surface.CreateInput("roughness", T.Float).ConnectToSource(texture.ConnectableAPI(), "b")
    look.surface(surface)
    read = look.read()
    assert surface_of(read.prims["/look"]) == (
        "preview_surface",
        {"diffuseColor": (1, 0, 0.5), "roughness": 0.5},
    )
    assert read.said("/look/t", "/no.png")


def test_inputs_pass_through_node_graphs_and_interfaces():
    look = Look()
    interface = look.material.CreateInput("tint", T.Color3f)
    interface.Set((0.1, 0.2, 0.3))
    graph = UsdShade.NodeGraph.Define(look.stage, "/look/graph")
    inside = graph.CreateInput("color", T.Color3f)
    inside.ConnectToSource(interface)
    shader = look.node("graph/s", "UsdPreviewSurface")
    shader.CreateInput("diffuseColor", T.Color3f).ConnectToSource(inside)
    graph.CreateOutput("surface", T.Token).ConnectToSource(shader.ConnectableAPI(), "surface")
    look.material.CreateSurfaceOutput().ConnectToSource(graph.ConnectableAPI(), "surface")
    _, inputs = surface_of(look.translated())
    assert inputs["diffuseColor"] == pytest.approx((0.1, 0.2, 0.3))


@pytest.mark.parametrize("node_id", ["my_shader", "", "mitsuba_diffuse"])
def test_unknown_shaders_are_named_and_the_display_color_is_drawn(node_id):
    look = Look()
    look.surface(look.node("s", node_id))
    read = look.read()
    assert read.said("/look", "/look/s")
    assert read.prims["/cube"].material == DISPLAY_COLOR


def test_noise_of_materialx_is_the_same_noise():
    """A sum of so many octaves, signed; without a position that in the object's space."""
    look = Look()
    noise = look.node("noise", "ND_fractal3d_float", octaves=(T.Int, 4), diminish=(T.Float, 0.6))
    look.surface(look.node("s", "UsdPreviewSurface", roughness=(T.Float, noise, "out")))
    read = look.read()
    _, inputs = surface_of(read.prims["/look"])
    kind, octaves = inputs["roughness"]
    assert kind == "noise"
    assert octaves["vector"] == ("coordinate", {"space": "object"})
    assert (octaves["scale"], octaves["detail"], octaves["normalize"]) == (1.0, 3.0, "false")
    assert octaves["roughness"] == pytest.approx(0.6)
    assert not read.messages


def test_an_unknown_pattern_leaves_the_default():
    look = Look()
    noise = look.node("noise", "ND_worleynoise3d_float")
    look.surface(look.node("s", "UsdPreviewSurface", roughness=(T.Float, noise, "out"), ior=(T.Float, 1.25)))
    read = look.read()
    assert surface_of(read.prims["/look"]) == ("preview_surface", {"ior": 1.25})
    assert read.said("/look/noise", "ND_worleynoise3d_float")


def test_a_circle_of_shaders_ends():
    look = Look()
    a = look.node("a", "ND_add_color3", in1=(T.Color3f, (1, 1, 1)))
    b = look.node("b", "ND_add_color3", in1=(T.Color3f, a, "out"))
    a.CreateInput("in2", T.Color3f).ConnectToSource(b.ConnectableAPI(), "out")
    look.surface(look.node("s", "UsdPreviewSurface", diffuseColor=(T.Color3f, b, "out")))
    assert any("circle" in m[2] for m in look.read().messages)


def _vdf(look, **inputs):
    vdf = look.node("vdf", "ND_anisotropic_vdf", **inputs)
    return look.node("volume", "ND_volume", vdf=(T.Token, vdf, "out"))


def test_a_homogeneous_medium_has_no_surface():
    look = Look()
    look.volume(
        _vdf(
            look,
            absorption=(T.Float3, (1, 2, 3)),
            scattering=(T.Float3, (4, 5, 6)),
            anisotropy=(T.Float, 0.5),
        )
    )
    read = look.read()
    material = read.prims["/look"]
    assert material.surface is None
    assert volume_of(material) == (
        "volume",
        {"absorption": (1, 2, 3), "scattering": (4, 5, 6), "anisotropy": 0.5},
    )
    assert read.prims["/cube"].material == "/look"
    assert not read.messages


def test_fields_multiply_coefficients():
    look = Look()
    density = look.node("d", "ND_geompropvalue_float", geomprop=(T.String, "smoke"))
    scaled = look.node("k", "ND_multiply_float", in1=(T.Float, 3.0), in2=(T.Float, density, "out"))
    product = look.node("p", "ND_multiply_vector3FA", in1=(T.Float3, (1, 2, 3)), in2=(T.Float, scaled, "out"))
    emission = look.node("e", "ND_uniform_edf", color=(T.Color3f, product, "out"))
    volume = _vdf(look, scattering=(T.Float3, product, "out"), absorption=(T.Float3, density, "out"))
    volume.CreateInput("edf", T.Token).ConnectToSource(emission.ConnectableAPI(), "out")
    look.volume(volume, "mtlx")
    _, inputs = volume_of(look.translated())
    field = ("field", {"name": "smoke"})
    assert inputs["scattering"] == ("multiply", {"in1": (3, 6, 9), "in2": field})
    assert inputs["absorption"] == ("multiply", {"in1": (1, 1, 1), "in2": field})
    assert inputs["emission"] == ("multiply", {"in1": (3, 6, 9), "in2": field})


def test_what_a_volume_cannot_be_fed_by_is_named():
    look = Look()
    a = look.node("a", "ND_geompropvalue_float", geomprop=(T.String, "a"))
    b = look.node("b", "ND_geompropvalue_float", geomprop=(T.String, "b"))
    both = look.node("ab", "ND_multiply_float", in1=(T.Float, a, "out"), in2=(T.Float, b, "out"))
    three = look.node("aba", "ND_multiply_float", in1=(T.Float, both, "out"), in2=(T.Float, a, "out"))
    total = look.node("sum", "ND_add_float", in1=(T.Float, a, "out"), in2=(T.Float, b, "out"))
    look.volume(_vdf(look, scattering=(T.Float3, three, "out"), absorption=(T.Float3, total, "out")))
    messages = " ".join(m[2] for m in look.read().messages)
    assert "several fields" in messages
    assert "add" in messages


def test_an_unknown_volume_shader_leaves_a_volume_with_the_default_medium(tmp_path):
    look = Look()
    look.volume(look.node("v", "my_volume"))
    grid = tmp_path / "g.vdb"
    grid.write_bytes(b"")
    volume = look.stage.DefinePrim("/v", "Volume")
    field = look.stage.DefinePrim("/v/f", "OpenVDBAsset")
    field.GetAttribute("filePath").Set(str(grid))
    volume.CreateRelationship("field:density").SetTargets(["/v/f"])
    UsdShade.MaterialBindingAPI.Apply(volume).Bind(look.material)
    read = look.read()
    assert read.prims["/v"].material is None
    assert read.said("/v", "/look")
    assert read.said("/look", "my_volume")
    assert read.prims["/cube"].material == DISPLAY_COLOR


def test_materialx_closures():
    look = Look()
    glass = look.node(
        "glass",
        "ND_dielectric_bsdf",
        ior=(T.Float, 1.25),
        roughness=(T.Float2, (0.25, 0.25)),
        scatter_mode=(T.String, "RT"),
    )
    metal = look.node("metal", "ND_conductor_bsdf", roughness=(T.Float2, (0, 0)))
    mixed = look.node(
        "mix", "ND_mix_bsdf", bg=(T.Token, glass, "out"), fg=(T.Token, metal, "out"), mix=(T.Float, 0.25)
    )
    edf = look.node("edf", "ND_uniform_edf", color=(T.Color3f, (2, 2, 2)))
    look.surface(
        look.node("s", "ND_surface", bsdf=(T.Token, mixed, "out"), edf=(T.Token, edf, "out")), "mtlx", "out"
    )
    kind, inputs = surface_of(look.translated())
    assert (kind, inputs["emission"]) == ("surface", (2, 2, 2))
    name, mix = inputs["bsdf"]
    assert (name, mix["mix"]) == ("mix_closure", 0.25)
    assert mix["a"] == ("dielectric", {"ior": 1.25, "roughness": 0.5, "tint": (1, 1, 1), "mode": "RT"})
    assert mix["b"][0] == "conductor"


@pytest.mark.parametrize(
    ("node_id", "inputs", "expected"),
    [
        (
            "ND_standard_surface_surfaceshader",
            {
                "base": (T.Float, 0.5),
                "base_color": (T.Color3f, (1, 0.5, 0)),
                "specular_roughness": (T.Float, 0.25),
            },
            {"diffuseColor": (0.5, 0.25, 0), "roughness": 0.25, "ior": 1.5},
        ),
        (
            "ND_open_pbr_surface_surfaceshader",
            {"base_metalness": (T.Float, 1), "emission_luminance": (T.Float, 2)},
            {"metallic": 1, "emissiveColor": (2, 2, 2)},
        ),
        (
            "ND_gltf_pbr_surfaceshader",
            {"metallic": (T.Float, 0), "alpha": (T.Float, 0.5)},
            {"metallic": 0, "opacity": 0.5},
        ),
    ],
)
def test_uber_shaders_become_preview_surfaces(node_id, inputs, expected):
    look = Look()
    look.surface(look.node("s", node_id, subsurface=(T.Float, 0.5), **inputs), "mtlx", "out")
    read = look.read()
    kind, translated = surface_of(read.prims["/look"])
    assert kind == "preview_surface"
    assert {name: translated[name] for name in expected} == expected
    assert read.said("/look/s", "subsurface")


def test_transmissive_uber_shaders_become_glass():
    look = Look()
    look.surface(
        look.node("s", "ND_standard_surface_surfaceshader", transmission=(T.Float, 1)), "mtlx", "out"
    )
    kind, inputs = surface_of(look.translated())
    assert (kind, inputs["mode"], inputs["ior"]) == ("dielectric", "RT", 1.5)


def test_arnold_volumes_are_read_with_a_message():
    stage = tyndall_usd.open_stage(shared("data", "arnold_2239", "test.usda"))
    read = translate(stage, time=Usd.TimeCode(2))
    (path, material) = next((p, m) for p, m in read.of_type(Material).items() if m.volume is not None)
    _, inputs = volume_of(material)
    factor, field = inputs["scattering"][1]["in1"], inputs["scattering"][1]["in2"]
    assert factor == pytest.approx((0.5, 0.5, 0.5), rel=1e-6)
    assert field[1]["name"] == "voxel_fog_density"
    assert any("ignored inputs" in m[2] for m in read.messages), path


def test_the_purpose_full_wins_and_collections_bind():
    look = Look()
    look.surface(look.node("s", "UsdPreviewSurface"))
    full = UsdShade.Material.Define(look.stage, "/full")
    shader = UsdShade.Shader.Define(look.stage, "/full/s")
    shader.CreateIdAttr("UsdPreviewSurface")
    full.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    api = UsdShade.MaterialBindingAPI(look.cube)
    api.Bind(full, UsdShade.Tokens.weakerThanDescendants, "full")
    assert look.read().prims["/cube"].material == "/full"
    root = UsdGeom.Xform.Define(look.stage, "/group")
    UsdGeom.Cube.Define(look.stage, "/group/inside")
    UsdGeom.Cube.Define(look.stage, "/group/outside")
    collection = Usd.CollectionAPI.Apply(root.GetPrim(), "some")
    collection.IncludePath("/group/inside")
    UsdShade.MaterialBindingAPI.Apply(root.GetPrim()).Bind(collection, full)
    prims = look.read().prims
    assert prims["/group/inside"].material == "/full"
    assert prims["/group/outside"].material == DISPLAY_COLOR


def test_only_primvars_that_shading_reads_are_sent():
    look = Look()
    reader = look.node("r", "UsdPrimvarReader_float3", varname=(T.String, "tint"))
    look.surface(look.node("s", "UsdPreviewSurface", diffuseColor=(T.Color3f, reader, "result")))
    api = UsdGeom.PrimvarsAPI(look.cube)
    for name in ("tint", "other"):
        api.CreatePrimvar(name, T.Color3f, "constant").Set((1, 0, 0))
    assert set(look.read().prims["/cube"].primvars) == {"tint"}


def test_the_materials_of_the_cases_are_exact():
    prims = translate(tyndall_usd.open_stage(shared("cases", "scenes", "cloud.usda"))).prims
    _, inputs = volume_of(prims["/World/Looks/vol_smoke_grid"])
    field = ("field", {"name": "density", "default": 0.0})
    assert inputs["scattering"] == ("multiply", {"in1": pytest.approx((59.4, 58.2, 55.2)), "in2": field})
    assert inputs["anisotropy"] == pytest.approx(0.45)
    kind, ground = surface_of(prims["/World/Looks/ground"])
    assert (kind, ground["bsdf"][0]) == ("surface", "diffuse")

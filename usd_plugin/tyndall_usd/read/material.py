"""UsdShadeMaterial: its terminals through the table of converters, and the fallback for what has none."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tyndall.graph import Graph, compact
from tyndall.medium import Medium, add_volume_node
from tyndall.prims import Material, Node, NodeRef

from tyndall_usd.shading.network import Network, ShaderNode, shader_id
from tyndall_usd.shading.table import CONVERTERS, SURFACE_CONTEXTS, VOLUME_CONTEXTS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pxr import Usd, UsdShade
    from tyndall.messages import Messages

    from tyndall_usd.assets import Assets

GREY = (0.18, 0.18, 0.18)


def display_color_material(*, opacity: bool) -> Material:
    """Return the look of gprims without a usable material: displayColor, or grey where there is none."""
    nodes = [
        Node("primvar", {"name": "displayColor", "default": GREY}),
        Node("diffuse", {"color": NodeRef(0)}),
    ]
    if not opacity:
        return Material(nodes, surface=1)
    nodes += [
        Node("primvar", {"name": "displayOpacity", "default": 1.0}),
        Node("surface", {"bsdf": NodeRef(1), "opacity": NodeRef(2)}),
    ]
    return Material(nodes, surface=3)


def read_material(
    material: UsdShade.Material, time: Usd.TimeCode, *, assets: Assets, messages: Messages
) -> Material | None:
    """Read the material; ``None``, with messages, if neither of its terminals can be converted."""
    graph = Graph()
    surface = _terminal(material, graph, time, assets, messages, is_volume=False)
    volume = _terminal(material, graph, time, assets, messages, is_volume=True)
    if surface is None and (volume is None or _has_terminal(material, is_volume=False)):
        if volume is None and not any(_has_terminal(material, is_volume=v) for v in (False, True)):
            messages.warning(
                material.GetPath(), "the material has no surface and no volume", "displayColor is drawn"
            )
        if volume is None:
            return None
        surface = _fallback_surface(graph)
    roots = [ref.index for ref in (surface, volume) if ref is not None]
    nodes, new_index = compact(graph.nodes, roots)
    return Material(
        nodes=nodes,
        surface=None if surface is None else new_index[surface.index],
        volume=None if volume is None else new_index[volume.index],
    )


def primvar_names(material: Material) -> set[str]:
    """Return the names of the primvars that `material` reads."""
    return {str(n.inputs["name"]) for n in material.nodes if n.kind == "primvar" and "name" in n.inputs}


def _fallback_surface(graph: Graph) -> NodeRef:
    color = graph.add("primvar", name="displayColor", default=GREY)
    return graph.add("diffuse", color=color)


def _outputs(material: UsdShade.Material, *, is_volume: bool) -> list[UsdShade.Output]:
    outputs = material.GetVolumeOutputs() if is_volume else material.GetSurfaceOutputs()
    return [output for output in outputs if output.HasConnectedSource()]


def _has_terminal(material: UsdShade.Material, *, is_volume: bool) -> bool:
    return bool(_outputs(material, is_volume=is_volume))


def _terminal(
    material: UsdShade.Material,
    graph: Graph,
    time: Usd.TimeCode,
    assets: Assets,
    messages: Messages,
    *,
    is_volume: bool,
) -> NodeRef | None:
    network = Network(graph, time, assets, messages, is_volume, CONVERTERS)
    unknown: list[str] = []
    for shader, output in _sources(material, is_volume=is_volume):
        if network.converter(shader_id(shader)) is None:
            unknown.append(f"{shader_id(shader) or 'without an id'!r} <{shader.GetPath()}>")
            continue
        value = network.convert(shader, output)
        if is_volume and isinstance(value, Medium):
            return add_volume_node(ShaderNode(network, shader, output, shader_id(shader)), value)
        if not is_volume and isinstance(value, NodeRef):
            return value
        unknown.append(f"{shader_id(shader)!r} <{shader.GetPath()}>")
    kind = "volume" if is_volume else "surface"
    if unknown:
        messages.warning(
            material.GetPath(),
            f"{kind} shader {', '.join(dict.fromkeys(unknown))} is not supported",
            "use UsdPreviewSurface or MaterialX; displayColor is drawn"
            if not is_volume
            else "use MaterialX's ND_volume; the default medium is drawn",
        )
    else:
        others = [str(output.GetFullName()) for output in _outputs(material, is_volume=is_volume)]
        if others:
            messages.warning(
                material.GetPath(),
                f"only {', '.join(others)} is connected",
                f"connect outputs:{kind} or outputs:mtlx:{kind}",
            )
    return None


def _sources(material: UsdShade.Material, *, is_volume: bool) -> Sequence[tuple[UsdShade.Shader, str]]:
    """Return the shader and output behind each terminal that is read, best context first."""
    compute = material.ComputeVolumeSource if is_volume else material.ComputeSurfaceSource
    found: dict[str, tuple[UsdShade.Shader, str]] = {}
    for context in VOLUME_CONTEXTS if is_volume else SURFACE_CONTEXTS:
        shader, output, _ = compute(context)
        if shader:
            found.setdefault(str(shader.GetPath()), (shader, str(output)))
    return list(found.values())

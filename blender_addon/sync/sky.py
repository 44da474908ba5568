# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds of any nodes as images: painted by the Cycles of another Blender process, once for each state.

No other way gives all of Blender's textures and skies, exactly and in every version. Blender cannot render
while it renders, so the process has to be another one.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING

import bpy

from .images import TemporaryFolder

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tyndall.messages import Messages

_SCRIPT = Path(__file__).resolve().parents[1] / "bake_sky.py"
#: Pixels across: skies are smooth, and a sun is three of them wide. Images in nodes ask for their own size.
_WIDTH, _WIDEST = 2048, 8192
#: Seconds after which painting a sky has failed.
_PATIENCE = 600.0
#: Skies kept; one takes about 10 MB of disk.
_KEPT = 16
#: Properties of nodes that do not change the picture.
_IRRELEVANT = frozenset(
    {
        *("rna_type", "name", "label", "location", "location_absolute", "width", "width_hidden", "height"),
        *(
            "dimensions",
            "select",
            "parent",
            "node",
            "links",
            "internal_links",
            "outputs",
            "color",
            "use_custom_color",
        ),
        *("color_tag", "warning_propagation", "bl_icon", "id_data", "debug_zone_body_lazy_function_graph"),
        *("show_options", "show_preview", "show_texture", "show_expanded", "hide", "hide_value"),
        *("is_active_output", "is_inactive", "is_icon_visible", "panel_states"),
    }
)
#: Coordinates that depend on where the camera is.
_OF_VIEW = ("Camera", "Window", "Reflection")


class SkyPainter:
    """Paints skies, one at a time; what it has painted serves all renders of this Blender."""

    def __init__(self) -> None:
        self._folder: TemporaryFolder | None = None
        self._skies: dict[str, Path | str] = {}
        self._lock = threading.Lock()
        self._running: threading.Thread | None = None
        self._waiting: set[Callable[[], None]] = set()

    def sky_of(
        self,
        world: bpy.types.World,
        frame: float,
        messages: Messages,
        path: str,
        notify: Callable[[], None] | None,
    ) -> str | None:
        """Return the image of an evaluated world; ``None`` if there is none, with a message why.

        With `notify` it does not wait for a sky that is not painted yet: `notify` is called once it is.
        """
        _report(world.node_tree, path, messages)
        key = _fingerprint(world)
        if key not in self._skies:
            self._paint(world, frame, key, notify)
        sky = self._skies.get(key)
        if sky is None:
            messages.info(path, "the sky is still being painted", "it is grey until then")
            return None
        if isinstance(sky, str):
            messages.warning(path, f"the world's nodes could not be baked: {sky}", "the sky is grey")
            return None
        return str(sky)

    def _paint(
        self, world: bpy.types.World, frame: float, key: str, notify: Callable[[], None] | None
    ) -> None:
        if notify is None:
            self._paint_and_wait(world, frame, key)
            return
        with self._lock:
            self._waiting.add(notify)
            # Who is told that a sky is done asks again.
            if self._running is None:
                self._start(world, frame, key)

    def _paint_and_wait(self, world: bpy.types.World, frame: float, key: str) -> None:
        while key not in self._skies:
            with self._lock:
                running = self._running or self._start(world, frame, key)
            running.join()

    def _start(self, world: bpy.types.World, frame: float, key: str) -> threading.Thread:
        if self._folder is None:
            self._folder = TemporaryFolder()
        library, target = (self._folder.path / f"{key}.{ending}" for ending in ("blend", "exr"))
        bpy.data.libraries.write(str(library), {world.original}, path_remap="ABSOLUTE")
        width = min(max([_WIDTH, *_image_widths(world.node_tree)]), _WIDEST)
        arguments = [str(library), world.original.name, str(frame), str(width), str(target)]
        self._running = threading.Thread(
            target=self._run, args=(key, target, arguments), name="tyndall-sky", daemon=True
        )
        self._running.start()
        return self._running

    def _run(self, key: str, target: Path, arguments: list[str]) -> None:
        sky = _painted(target, arguments)
        with self._lock:
            while len(self._skies) >= _KEPT:
                oldest = self._skies.pop(next(iter(self._skies)))
                if isinstance(oldest, Path):
                    oldest.unlink(missing_ok=True)
            self._skies[key] = sky
            waiting, self._waiting, self._running = self._waiting, set(), None
        for notify in waiting:
            notify()


def _painted(target: Path, arguments: list[str]) -> Path | str:
    """Have the sky painted; return its image, or why there is none."""
    try:
        done = subprocess.run(
            [*_blender(), *arguments], capture_output=True, text=True, timeout=_PATIENCE, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return str(error)
    if done.returncode == 0 and target.is_file():
        return target
    said = (done.stderr or done.stdout).strip().splitlines()
    return said[-1] if said else "no reason was given"


#: The one of this Blender.
PAINTER = SkyPainter()


def _blender() -> list[str]:
    """Return the command that runs the script in another process like this one."""
    if bpy.app.binary_path:
        return [bpy.app.binary_path, "--background", "--factory-startup", "--python", str(_SCRIPT), "--"]
    return [sys.executable, str(_SCRIPT), "--"]


def _nodes(tree: bpy.types.NodeTree) -> Iterator[bpy.types.Node]:
    """Yield all nodes, those in groups too."""
    for node in tree.nodes:
        yield node
        if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
            yield from _nodes(node.node_tree)


def _image_widths(tree: bpy.types.NodeTree) -> list[int]:
    images = [getattr(node, "image", None) for node in _nodes(tree)]
    return [int(image.size[0]) for image in images if image is not None]


def _report(tree: bpy.types.NodeTree, path: str, messages: Messages) -> None:
    for node in _nodes(tree):
        image = getattr(node, "image", None)
        if node.bl_idname == "ShaderNodeLightPath":
            messages.warning(
                path, "the world differs by the kind of ray", "all rays see what diffuse ones see"
            )
        elif node.bl_idname == "ShaderNodeTexCoord" and any(
            node.outputs[name].is_linked for name in _OF_VIEW
        ):
            messages.warning(
                path, "the world depends on the camera", "it is that of a camera looking along +X"
            )
        elif image is not None and image.is_dirty:
            messages.warning(path, f"the image {image.name!r} is not saved", "the world shows it as it was")


def _fingerprint(world: bpy.types.World) -> str:
    return hashlib.sha256(repr(_state_of_tree(world.node_tree)).encode()).hexdigest()[:24]


def _state_of_tree(tree: bpy.types.NodeTree) -> object:
    links = [
        (n.from_node.name, n.from_socket.identifier, n.to_node.name, n.to_socket.identifier, n.is_muted)
        for n in tree.links
    ]
    return [(node.name, node.bl_idname, _state(node, 0)) for node in tree.nodes], links


def _state(struct: bpy.types.bpy_struct, depth: int) -> object:
    """Return all values of a structure, and of those inside of it, as something that can be compared."""
    values = []
    for p in struct.bl_rna.properties:
        if p.identifier in _IRRELEVANT or depth > 4:
            continue
        value = getattr(struct, p.identifier)
        if p.type == "COLLECTION":
            value = [_state(item, depth + 1) for item in value]
        elif p.type == "POINTER" and value is not None:
            value = _state_of_data(value) if isinstance(value, bpy.types.ID) else _state(value, depth + 1)
        elif getattr(p, "is_array", False):
            value = tuple(value)
        values.append((p.identifier, value))
    return values


def _state_of_data(data: bpy.types.ID) -> object:
    if isinstance(data, bpy.types.NodeTree):
        return _state_of_tree(data)
    if isinstance(data, bpy.types.Image):
        return data.name_full, bpy.path.abspath(data.filepath), tuple(data.size), data.is_dirty
    if isinstance(data, bpy.types.Object):
        return data.name_full, [tuple(row) for row in data.matrix_world]
    return data.name_full

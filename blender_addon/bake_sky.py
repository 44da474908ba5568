# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by a Blender of its own: LIBRARY WORLD FRAME WIDTH TARGET has Cycles paint a world as a float EXR.

The image is laid out as Blender's Environment Texture reads it. Fog is left out. What asks for the kind of
ray is told that it is a diffuse one: light counts for more of a picture than its background.
"""

from __future__ import annotations

import math
import os
import sys

import bpy

#: Samples per pixel, at least and at most: small suns need many, and Cycles notices.
_SAMPLES = (4, 256)


def main(library: str, name: str, frame: str, width: str, target: str) -> None:
    """Paint."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(library) as (_, taken):
        taken.worlds = [name]
    scene = bpy.context.scene
    scene.world = taken.worlds[0]
    _prepare(scene.world.node_tree)
    _set_cycles(scene)
    _add_camera(scene)
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = int(width), int(width) // 2, 100
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    render.image_settings.color_mode, render.image_settings.exr_codec = "RGB", "ZIP"
    render.filepath, render.use_file_extension = target, False
    whole = math.floor(float(frame))
    scene.frame_set(whole, subframe=float(frame) - whole)
    bpy.ops.render.render(write_still=True)


def _prepare(tree: bpy.types.NodeTree) -> None:
    for node in list(tree.nodes):
        if node.bl_idname == "ShaderNodeOutputWorld":
            for link in list(node.inputs["Volume"].links):
                tree.links.remove(link)
        elif node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
            _prepare(node.node_tree)
        elif node.bl_idname == "ShaderNodeLightPath":
            for link in [link for output in node.outputs for link in output.links]:
                value = tree.nodes.new("ShaderNodeValue")
                value.outputs[0].default_value = float(link.from_socket.identifier == "Is Diffuse Ray")
                tree.links.new(value.outputs[0], link.to_socket)


def _set_cycles(scene: bpy.types.Scene) -> None:
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_denoising = cycles.use_auto_tile = False
    cycles.use_adaptive_sampling, cycles.adaptive_threshold = True, 0.01
    cycles.adaptive_min_samples, cycles.samples = _SAMPLES
    cycles.pixel_filter_type = "BOX"
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    # Nothing is lit: Cycles need not look for the bright parts.
    scene.world.cycles.sampling_method = "NONE"


def _add_camera(scene: bpy.types.Scene) -> None:
    camera = bpy.data.cameras.new("Camera")
    camera.type = "PANO"
    # Before Blender 5.0 the kind of panorama was a setting of Cycles'.
    owner = camera if hasattr(camera, "panorama_type") else camera.cycles
    owner.panorama_type = "EQUIRECTANGULAR"
    thing = bpy.data.objects.new("Camera", camera)
    thing.rotation_euler = (math.pi / 2, 0.0, -math.pi / 2)
    scene.collection.objects.link(thing)
    scene.camera = thing


code = 0
try:
    main(*sys.argv[sys.argv.index("--") + 1 :])
except Exception as error:
    print(f"{type(error).__name__}: {error}", file=sys.stderr)  # noqa: T201
    code = 1
sys.stdout.flush()
sys.stderr.flush()
# Some versions crash or hang when Python ends in the ordinary way.
os._exit(code)

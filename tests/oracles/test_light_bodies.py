"""Lights that are no obstacle, and lights that the camera does not see."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.statistics import estimate

tyndall = pytest.importorskip("tyndall", reason="the binding is not built: run `make build`")
prims = tyndall.prims

SEEDS = 6


def _placed(z: float, *, looking_up: bool = False) -> np.ndarray:
    matrix = np.diag([1.0, -1.0, -1.0, 1.0]) if looking_up else np.eye(4)
    matrix[2, 3] = z
    return matrix


def _images(shot: dict[str, Any], *, samples: int = 16, bounces: int = 8, aov: str = "rgba") -> np.ndarray:
    delegate = tyndall.RenderDelegate()
    delegate.sync("/Camera", prims.Camera(world_from_camera=_placed(3.0), aperture=(1, 1), focal_length=4))
    for path, prim in shot.items():
        delegate.sync(path, prim)
    scene = delegate.commit()
    images = []
    for seed in range(SEEDS):
        settings = {"resolution": [8, 8], "samples": samples, "maxBounces": bounces, "seed": seed}
        session = tyndall.Session(scene, {**settings, "filter": "box", "threads": 1, "aovs": ["rgba", aov]})
        images.append(np.array(session.render().aov(aov)))
    return np.stack(images)


def _card(**attributes: Any) -> Any:
    return prims.Light(kind="rect", params={"width": 2, "height": 2}, intensity=2, **attributes)


DOME = prims.Light(kind="dome", intensity=0.5)
FOG = prims.Material(nodes=[prims.Node("volume", {"scattering": (1.0, 1.0, 1.0)})], volume=0)


@pytest.mark.parametrize("up", [False, True])
def test_the_camera_sees_through_a_card_or_past_it(up: bool) -> None:
    """The lit side of a card is seen from below it, the camera is above."""
    matrix = _placed(0.0, looking_up=up)
    shine = 2.0 if up else 0.0
    for attributes, expected in (
        ({}, shine),
        ({"opaque": False}, shine + 0.5),
        ({"camera_visible": False}, 0.5),
        ({"camera_visible": False, "opaque": False}, 0.5),
    ):
        image = _images({"/Dome": DOME, "/Card": _card(world_from_light=matrix, **attributes)})
        assert image[..., :3] == pytest.approx(expected, abs=1e-6), attributes


def test_a_background_hidden_from_the_camera_lights_and_leaves_no_alpha() -> None:
    hidden = prims.Light(kind="dome", intensity=0.5, camera_visible=False)
    white = prims.Material(nodes=[prims.Node("diffuse", {"color": (1.0, 1.0, 1.0)})], surface=0)
    empty = _images({"/Dome": hidden})
    assert (empty == 0).all()
    # A white body under an even sky is as bright as the sky, and bounces see it.
    ball = prims.Shape(kind="sphere", params={"radius": 1.0}, material="/White")
    image = _images({"/Dome": hidden, "/White": white, "/Ball": ball}, samples=64)
    assert abs(estimate(image[..., :3]).z(0.5)).max() < 4
    assert (image[..., 3] == 1).all()


@pytest.mark.parametrize("kind", ["rect", "sphere", "disk"])
def test_furnace_of_fog_around_a_light_that_is_no_obstacle(kind: str) -> None:
    """A light as bright as the even sky, seen through white fog: its radiance comes on top of the sky's.

    Light that passes the body is neither lost nor counted twice: white fog in a furnace of radiance 0.5 is
    invisible, and the light adds to it what it would add to a black world.
    """
    params = {"rect": {"width": 0.8, "height": 0.8}, "sphere": {"radius": 0.4}, "disk": {"radius": 0.4}}
    light = prims.Light(
        kind=kind,
        params=params[kind],
        intensity=2.0,
        opaque=False,
        world_from_light=_placed(0, looking_up=True),
    )
    body = prims.Shape(kind="sphere", params={"radius": 1.0}, material="/Fog")
    fog = {"/Fog": FOG, "/Body": body}
    alone = estimate(_images({**fog, "/Light": light}, samples=256, bounces=200)[..., :3])
    both = estimate(_images({**fog, "/Light": light, "/Dome": DOME}, samples=256, bounces=200)[..., :3])
    error = np.hypot(alone.error, both.error)
    assert (np.abs(both.mean - alone.mean - 0.5) < 4 * error).all(), (alone, both)


def test_an_opaque_light_does_block() -> None:
    """The test above can fail: an opaque card takes away some of the sky."""
    body = prims.Shape(kind="sphere", params={"radius": 1.0}, material="/Fog")
    fog = {"/Fog": FOG, "/Body": body, "/Light": _card(world_from_light=_placed(0.0, looking_up=True))}
    alone = estimate(_images(fog, samples=64)[..., :3])
    both = estimate(_images({**fog, "/Dome": DOME}, samples=64)[..., :3])
    error = np.hypot(alone.error, both.error)
    assert (both.mean - alone.mean - 0.5 < -4 * error).all()


def test_transmittance_reaches_the_surface_behind_a_light_that_was_passed() -> None:
    absorbing = prims.Material(nodes=[prims.Node("volume", {"absorption": (0.5, 0.5, 0.5)})], volume=0)
    body = prims.Shape(kind="cube", params={"size": 2.0}, material="/Fog")
    floor = prims.Shape(kind="plane", params={"width": 50, "length": 50}, world_from_object=_placed(-5.0))
    shot = {"/Fog": absorbing, "/Body": body, "/Floor": floor, "/Card": _card(opaque=False)}
    seen = estimate(_images(shot, samples=256, aov="transmittance"))
    without = estimate(
        _images({k: v for k, v in shot.items() if k != "/Card"}, samples=256, aov="transmittance")
    )
    assert (np.abs(seen.mean - without.mean) < 4 * np.hypot(seen.error, without.error)).all(), (seen, without)

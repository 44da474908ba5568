"""Somebody who stops a render waits for it: what is cut off is not learned from, what is done stays."""

from __future__ import annotations

from typing import Any

import pytest

tyndall = pytest.importorskip("tyndall", reason="the binding is not built: run `make build`")


def session(resolution: list[int]) -> Any:
    """Return a render of a ball under a sky that learns from every pass."""
    delegate = tyndall.RenderDelegate()
    delegate.sync("/ball", tyndall.prims.Shape(kind="sphere", params={"radius": 1.0}))
    delegate.sync("/sky", tyndall.prims.Light(kind="dome"))
    above = tyndall.prims.identity()
    above[2, 3] = 4.0
    delegate.sync("/camera", tyndall.prims.Camera(world_from_camera=above))
    settings = {"resolution": resolution, "samples": 16, "guiding": "on", "threads": 2}
    return tyndall.Session(delegate.commit(), settings)


def test_a_pass_that_is_cut_off_teaches_nothing() -> None:
    # A pass over so many pixels takes longer than it takes to be asked for the first time.
    stopped = session([1920, 1080])
    film = stopped.render(lambda _: False)
    assert film.was_interrupted
    assert film.samples == 0
    assert stopped.field.cells("surface") == []
    whole = session([64, 48])
    assert whole.render().samples == 16
    assert whole.field.cells("surface") != []


def test_films_do_not_change_when_the_render_goes_on() -> None:
    running = session([64, 48])
    asked = iter([True, False])
    first = running.render(lambda _: next(asked, False))
    before = first.aov("rgba").copy()
    last = running.render()
    assert (first.aov("rgba") == before).all()
    assert last.samples == 16
    assert (last.aov("rgba") != before).any()


def test_previews_are_pictures_without_holes() -> None:
    running = session([320, 240])
    seen = []

    def look(_: Any) -> None:
        preview = running.preview()
        if preview is not None:
            seen.append(preview)

    running.preview()
    running.render(look)
    assert seen, "16 samples of 320 x 240 pixels take longer than one look"
    for samples, image in seen:
        assert 0 < samples <= 16
        assert image.shape == (240, 320, 4)
        assert (image[0, 0, :3] > 0).all(), "the sky"

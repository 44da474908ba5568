"""Single scattering along a ray in fog lit by a point light, against a 30-digit quadrature."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from support.oracles import judge, table
from support.render import Shot
from support.stages import StageBuilder

if TYPE_CHECKING:
    from pathlib import Path

ROWS = table()["airlight_point_light"]["rows"]


def row_id(row: dict[str, Any]) -> str:
    return (
        "sigma{sigma_t:g}-albedo{albedo:g}-g{g:g}-light{light_along:g},{light_off:g}-to{ray_length}".format(
            **row
        )
    )


@pytest.mark.parametrize("row", ROWS, ids=row_id)
def test_airlight(tmp_path: Path, row: dict[str, Any]) -> None:
    stage = StageBuilder(4, 4)
    stage.camera((0, 0, 0), (1, 0, 0), vfov=1e-4, clip=(1e-7, 1e7))
    far = 150.0 / row["sigma_t"]
    fog = stage.medium(row["sigma_t"], row["albedo"], row["g"])
    stage.box((-far, -far, -far), (far, far, far), fog)
    stage.point((row["light_along"], row["light_off"], 0), 1.0)
    if row["ray_length"] is not None:
        # A black wall, wider than the view and too small to shade the light noticeably.
        stage.quad((row["ray_length"], -1e-5, -1e-5), (0, 2e-5, 0), (0, 0, 2e-5), stage.lambert(0.0))
    judge(Shot(stage, tmp_path).seeds(8, spp=4096, max_bounces=1), row["radiance"], relative_error=0.01)

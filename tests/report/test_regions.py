"""Regions in the legend of a scene: a body and the regions of its mesh file are told once."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import numpy.typing as npt
import pytest

from hvi_fenicsx.report.pictures.regions import regions

WHOLE, LEFT, RIGHT = np.arange(4), np.arange(2), np.arange(2, 4)


@pytest.mark.parametrize(
    ("named", "told"),
    [
        ({"upper": WHOLE, "upper.inside": WHOLE}, ["upper"]),
        ({"upper": WHOLE, "upper.core": LEFT}, ["upper", "upper.core"]),
        ({"upper": WHOLE, "upper.core": LEFT, "upper.skin": RIGHT}, ["upper.core", "upper.skin"]),
        ({"steel": WHOLE, "core": LEFT}, ["steel", "steel and core"]),
    ],
)
def test_a_body_and_its_regions(named: dict[str, npt.NDArray[np.int64]], told: list[str]) -> None:
    result = SimpleNamespace(arrays=SimpleNamespace(regions=named), body=SimpleNamespace(cells=WHOLE))
    assert sorted(region.name for region in regions(result)) == told  # type: ignore[arg-type]

"""Why: a curved part plotted over a wrong arc length looks like noise, and in parallel its vertices come in any order.

The arc length is held to closed forms: angles on circles, the polygon's own lengths at a notch.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from runs import LONG_RANKS, contact, run_all
from scenes import STEEL

Array = npt.NDArray[Any]
R, H = 0.5, 0.1


def body(domain: dict[str, Any], on: Any, **more: Any) -> dict[str, Any]:
    """A body on springs along a part of its boundary, pulled down."""
    spring = {"law": "linear_spring", "stiffness": 1e10}
    return {
        "domain": domain,
        "material": STEEL,
        "body": {"force": [1.0e3, -8.0e4]},
        "boundary": {"ring": {"on": on, "friction": spring, "support": spring, **more}},
    }


STRIP = {"shape": "notched_strip", "size": [2.0, 1.0], "notch": [0.4, 0.3], "mesh_size": 0.1}
SCENES = {
    "arc": body({"shape": "half_disk", "radius": R, "mesh_size": H}, "arc"),
    "disk": body({"shape": "disk", "radius": R, "mesh_size": H}, ["lower_arc", "upper_arc"]),
    "notch": body(STRIP, "notch"),
    "top": body(STRIP, "top"),
}


@pytest.fixture(scope="module", params=LONG_RANKS)
def tables(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Array]:
    """``contact.csv`` of each scene, on one, two and three ranks."""
    folder = tmp_path_factory.mktemp("arc")
    run_all(folder, SCENES, request.param)
    return {name: contact(folder / f"{name}-{request.param}") for name in SCENES}


def angle(rows: Array, start: float) -> Array:
    """Along the circle around (0, R), counter-clockwise from ``start``, between 0 and 2π."""
    found = np.arctan2(rows["y"] - R, rows["x"]) - start
    return np.asarray(np.mod(found + 1e-6, 2 * np.pi) - 1e-6)


def test_on_an_arc_it_is_radius_times_angle(tables: dict[str, Array]) -> None:
    """Chords: between the vertices' angles φ they are 2 R sin(Δφ/2)."""
    rows = tables["arc"]
    phi = angle(rows, -np.pi)
    assert phi[0] == pytest.approx(0.0, abs=1e-9)
    assert phi[-1] == pytest.approx(np.pi)
    assert np.all(np.diff(phi) > 0)
    assert rows["s"] == pytest.approx(np.concatenate([[0], np.cumsum(2 * R * np.sin(np.diff(phi) / 2))]))
    assert rows["s"] == pytest.approx(R * phi, rel=H**2 / R**2 / 24 * 1.1)


def test_on_a_closed_disk_it_goes_round_once(tables: dict[str, Array]) -> None:
    rows = tables["disk"]
    phi = angle(rows, -np.pi)
    assert (rows["x"][0], rows["y"][0]) == pytest.approx((-R, R))
    assert np.all(np.diff(phi) > 0)
    assert rows["s"] == pytest.approx(np.concatenate([[0], np.cumsum(2 * R * np.sin(np.diff(phi) / 2))]))
    assert rows["s"][-1] == pytest.approx(2 * np.pi * R * (1 - 1 / len(rows)), rel=0.01)


def test_at_a_notch_it_goes_down_and_up_again(tables: dict[str, Array]) -> None:
    """A V of width 0.4 and depth 0.3: two sides of length √(0.2² + 0.3²)."""
    rows = tables["notch"]
    side = np.hypot(0.2, 0.3)
    assert rows["s"][-1] == pytest.approx(2 * side)
    assert rows["y"] == pytest.approx(1.0 - 0.3 * (1 - np.abs(rows["s"] - side) / side))

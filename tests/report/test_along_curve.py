"""The slip of a curved part in the plane is drawn in one direction along it, though its tangents turn their sign."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hvi_fenicsx import laws
from hvi_fenicsx.geometry import tangents
from hvi_fenicsx.report.contact_part import ContactPart
from hvi_fenicsx.report.pictures.along_curve import along_curve
from hvi_fenicsx.typing import Array

TRESCA = laws.Tresca(yield_traction=1e4)


class Told:
    """What a result says of a part's law."""

    def __init__(self, law: laws.Superpotential | None) -> None:
        self.given = law

    def law(self, part: str) -> laws.Superpotential | None:
        return self.given

    def resists(self, part: str, *directions: str) -> bool:
        return self.given is not None


def part(points: Array, normals: Array, slips: Array) -> ContactPart:
    """A chain of vertices, numbered backwards in the body, whose displacement is ``slips`` (m, 2)."""
    numbers = np.arange(len(points))[::-1] + 7
    along = np.sum(tangents(normals)[:, 0] * slips, axis=1)
    s = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    columns = {"s": s, "x": points[:, 0], "y": points[:, 1], "u_t1": along, "friction_t1": 3.0 * along}
    facets = np.column_stack([numbers[1:], numbers[:-1]])
    none = np.empty((len(points), 0))
    return ContactPart(
        name="bore", columns=columns, vertices=numbers, facets=facets, weight=none, normal=normals, drops=none
    )


def bore(turn: float = 1.0) -> ContactPart:
    """Clockwise round a bore, with the body on its left, as a closed chain goes; turned by 1."""
    angles = -np.linspace(0.1, 6.0, 40)
    out = np.column_stack([np.cos(angles), np.sin(angles)])
    return part(out, -out, turn * np.column_stack([out[:, 1], -out[:, 0]]))


@pytest.mark.parametrize("law", [TRESCA, None])
def test_a_bore_that_turns_slips_one_way(law: Any) -> None:
    given = bore()
    assert given["u_t1"].min() < -0.99
    assert given["u_t1"].max() > 0.99
    found = along_curve(Told(law), given)  # type: ignore[arg-type]
    assert found["u_t1"] == pytest.approx(np.ones(40))
    assert found["friction_t1"] == pytest.approx(np.full(40, 3.0))


def test_a_straight_part_keeps_the_signs_of_its_table() -> None:
    """Its table begins at the end of smaller x, so s grows downwards, while its tangents look upwards."""
    points = np.linspace([0.0, 1.0], [0.3, 0.0], 5)
    given = part(points, np.tile([1.0, 0.3], (5, 1)) / np.hypot(1.0, 0.3), np.tile([0.0, 1.0], (5, 1)))
    assert along_curve(Told(TRESCA), given) is given  # type: ignore[arg-type]
    assert given["u_t1"].min() > 0.0


def test_a_law_that_is_not_the_same_both_ways_keeps_them_too() -> None:
    given, one_sided = bore(), laws.Graph([[0, 0], [1, 1e4]], one_sided=True)
    assert along_curve(Told(one_sided), given) is given  # type: ignore[arg-type]

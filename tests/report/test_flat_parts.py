"""Contact parts that go round an axis are unrolled: no facet lies on another, and directions are those of the part."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hvi_fenicsx.report.body_mesh import BodyMesh
from hvi_fenicsx.report.pictures.contact import laid_flat
from hvi_fenicsx.typing import Array, Integers, Mask

RADIUS, HEIGHT, AROUND = 0.5, 1.2, 24


def shell(turn: float, around: int = AROUND) -> tuple[Array, Integers]:
    """The inside of a bore about y over an angle: points (m, 3), and facets that look at the axis."""
    closed = turn > 6.28
    angles = np.linspace(0.0, turn, around + (not closed), endpoint=not closed)
    low, high = (np.column_stack([RADIUS * np.cos(angles), np.full(len(angles), y), RADIUS * np.sin(angles)])
                 for y in (0.0, HEIGHT))  # fmt: skip
    first = np.arange(around)
    other, above = (first + 1) % len(angles), len(angles)
    facets = np.concatenate(
        [np.stack([first, other, first + above], 1), np.stack([other, other + above, first + above], 1)]
    )
    return np.concatenate([low, high]), facets


def bore(turn: float, idle: Mask | None = None, around: int = AROUND) -> tuple[Any, BodyMesh]:
    """A part that is all of a body's surface, and the body."""
    return laid(*shell(turn, around), idle=idle)


def laid(points: Array, facets: Integers, idle: Mask | None = None) -> tuple[Any, BodyMesh]:
    body, none = BodyMesh(points=points, cells=facets), np.zeros(len(points), dtype=bool)
    part = SimpleNamespace(points=points, normal=body.normals(facets), idle=none if idle is None else idle)
    return SimpleNamespace(part=part, facets=facets, row=np.arange(len(points))), body


def areas(points: Array, triangles: Integers) -> Array:
    one, other = (points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2))
    return np.asarray(0.5 * (one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]))


@pytest.mark.parametrize(("turn", "around"), [(2.0 * np.pi, AROUND), (2.0 * np.pi, 7), (1.6 * np.pi, AROUND)])
def test_an_unrolled_bore_has_the_area_of_its_shell_but_for_the_facets_across_its_cut(turn: float, around: int) -> None:
    flat = laid_flat(*bore(turn, around=around))
    each = areas(flat.points, flat.facets)
    assert np.all(each < 0.0) or np.all(each > 0.0)
    cut = turn * RADIUS * HEIGHT / around
    assert np.abs(each).sum() == pytest.approx(turn * RADIUS * HEIGHT, abs=1.01 * cut)
    assert (flat.names[1], flat.how) == ("y", "unrolled about y")


@pytest.mark.parametrize("around", [AROUND, 8])
def test_where_a_bore_touches_is_in_the_middle_of_its_map(around: int) -> None:
    points, _ = shell(2.0 * np.pi, around)
    flat = laid_flat(*bore(2.0 * np.pi, points[:, 0] > -0.8 * RADIUS, around))
    touching = flat.points[points[:, 0] <= -0.8 * RADIUS, 0]
    ends = flat.points[:, 0].min(), flat.points[:, 0].max()
    assert np.ptp(touching) < 0.25 * (ends[1] - ends[0])
    assert abs(touching.mean() - np.mean(ends)) < 0.5 / around * 2.1 * (ends[1] - ends[0])

"""Why: a side lost, a vertex off its curve or a wrong parent would still give a mesh, only of another body.

A refined mesh is held to the lengths and areas of the body, its prolongation to dolfinx's own interpolation.
"""

from __future__ import annotations

import functools
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from dolfinx import fem
from domains import BODIES, COMM, half_disk, lost, measure, towards, volume
from runs import LONG_RANKS

from hvi_fenicsx.mesh import refinement
from hvi_fenicsx.mesh.blocks import block
from hvi_fenicsx.mesh.domain import Domain


@pytest.mark.parametrize("make", BODIES[:2])
def test_sides_and_volume_stay_those_of_the_body(make: Callable[[], Domain]) -> None:
    body = make()
    before = {name: measure(body, name) for name in body.sides}, volume(body)
    for fine in (refinement.uniform(body), towards(body, np.array([1.0, 0.0, 0.0])[: body.dimension], 4)[-1]):
        after = {name: measure(fine.domain, name) for name in body.sides}, volume(fine.domain)
        assert after[0] == pytest.approx(before[0], rel=1e-12)
        assert after[1] == pytest.approx(before[1], rel=1e-12)


def test_curved_sides_approach_their_curve() -> None:
    """A half-disk of radius ½: inscribed polygons of π/2, whose error falls by 4 when edges are halved."""
    body, errors = half_disk(), []
    for _ in range(3):
        body = refinement.uniform(body).domain
        errors.append(np.pi / 2 - measure(body, "arc"))
        assert measure(body, "top") == pytest.approx(1.0, rel=1e-12)
    assert errors[:-1] == pytest.approx([4 * e for e in errors[1:]], rel=2e-2)


@pytest.mark.parametrize("make", BODIES[:2])
def test_prolongation_from_parent_cells(make: Callable[[], Domain]) -> None:
    """Against dolfinx's own interpolation between meshes that do not match."""
    body = make()
    d = body.dimension
    for step in (refinement.uniform(body), towards(body, np.zeros(d), 1)[0]):
        fine, coarse = (fem.functionspace(b.mesh, ("Lagrange", 1, (d,))) for b in (step.domain, body))
        assert lost(step.transfer.prolongation(fine, coarse), fine, coarse) < 1e-13


def smallest_angle(body: Domain) -> float:
    """Of all cells (2D) or of their faces (3D), degrees."""
    corners = refinement.cell_corners(body.mesh)
    worst = np.inf
    count = corners.shape[1]
    for i in range(count):
        for j in range(count):
            for k in range(j):
                if i in (j, k):
                    continue
                a, b = corners[:, j] - corners[:, i], corners[:, k] - corners[:, i]
                cosine = np.sum(a * b, axis=1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
                worst = min(worst, float(np.min(np.degrees(np.arccos(cosine)))))
    return worst


@pytest.mark.parametrize("make", BODIES)
def test_ten_steps_do_not_spoil_the_cells(make: Callable[[], Domain]) -> None:
    """Plaza's bisection leaves at least half the smallest angle of a triangle (Rosenberg and Stenger 1975)."""
    body = make()
    before = smallest_angle(body)
    steps = towards(body, np.zeros(body.dimension), 10)
    angles = [smallest_angle(step.domain) for step in steps]
    assert min(angles) > before / 2
    assert angles[9] > 0.9 * angles[5]


def test_in_space_the_diagonals_are_cut_and_no_shorter_edges() -> None:
    """Of n³ cubes cut into six: n³ diagonals of the cubes, 3 n² (n + 1) of their faces."""
    n, body = 6, block(COMM, [1.0, 1.0, 1.0], [6, 6, 6])
    fine = refinement.marked(body, np.arange(body.mesh.topology.index_map(3).size_local, dtype=np.int32)).domain
    assert fine.mesh.topology.index_map(0).size_global == (n + 1) ** 3 + n**3 + 3 * n**2 * (n + 1)


@pytest.mark.parametrize("ranks", [2, LONG_RANKS[2]])
def test_ranks_agree(ranks: int) -> None:
    """The same lengths, vertices and transferred field, however the mesh is split; ghosts are where owners are."""
    parallel = _run(ranks)
    serial = _run(1)
    assert parallel == pytest.approx(serial, rel=1e-10)


@functools.cache
def _run(ranks: int) -> list[float]:
    mpi = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    words = [*mpi, sys.executable, "-m", "mpi4py", "-m", "refined_ranks"]
    root = Path(__file__).parent
    out = subprocess.run(words, cwd=root, capture_output=True, text=True, check=True, timeout=300).stdout
    return [float(word) for word in out.split()]

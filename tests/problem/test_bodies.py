"""Several bodies in one mesh: each may escape for itself, so each has its kernel, its state and its held start.

Run as a script under mpirun this file prints what `told` says of the scenes in the given folder.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import meshes
import numpy as np
import numpy.typing as npt
import pytest
from mpi4py import MPI
from runs import LONG_RANKS, hvi, on_ranks, summary, write_scene
from scenes import NU, E, Table, quadratic_linear

from hvi_fenicsx import InputError, prepare, read_scene, read_tables, solve

GAMMA = 1.0e6
WORDS = ("translation along x", "translation along y")
CASES: dict[str, tuple[float, float]] = {
    "both-held": (0.3e6, -0.4e6),
    "one-held": (0.3e6, -0.6e6),
    "both-metastable": (0.55e6, -0.6e6),
    "one-escapes": (0.3e6, 1.2e6),
}
"""Push of block a and of block b, of γ2 = 0.5e6 and γ1 = 1e6 on an edge (face) of size 1."""
FILES = (("plane", 2), ("space", 3))
TOLD = (*(f"{case}-plane" for case in CASES), "one-held-space", "one-escapes-space")


def blocks(file: Path, dimension: int, push_a: float, push_b: float) -> Table:
    """Two unit blocks on a floor, each pushed for itself."""
    model = "plane_stress" if dimension == 2 else "three_dimensional"
    rest = [0.0] * (dimension - 1)
    return {
        "domain": {"shape": "file", "file": str(file)},
        "material": {"model": model, "youngs_modulus": E, "poisson_ratio": NU},
        "boundary": {
            "floor": {
                "on": ["bottom_a", "bottom_b"],
                "contact": {"gap": 0.0},
                "friction": quadratic_linear(GAMMA),
            },
            "press": {"on": ["top_a", "top_b"], "traction": [*rest, -8.0e6]},
            "push_a": {"on": ["left_a"], "traction": [push_a, *rest]},
            "push_b": {"on": ["right_b"], "traction": [push_b, *rest]},
        },
    }


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Meshes, and a scene of each case in the plane and in space."""
    found = tmp_path_factory.mktemp("bodies")
    for name, size, dimension, named in (
        ("plane.msh", 0.5, 2, True),
        ("nameless.msh", 0.5, 2, False),
        ("space.msh", 1.0, 3, True),
    ):
        meshes.make(found / name, meshes.BLOCKS.format(size=size, dimension=dimension, named=named))
    for name, pushes in CASES.items():
        for file, dimension in FILES:
            write_scene(found / f"{name}-{file}.toml", blocks(found / f"{file}.msh", dimension, *pushes))
    return found


def told(folder: Path, comm: MPI.Comm) -> dict[str, Any]:
    """Of each case: verdict and exit code, and for the plane ones the mean slip of each block, m."""
    found = {}
    for name in TOLD:
        solution = solve(read_scene(folder / f"{name}.toml"), comm)
        verdict = solution.solvability.summary()
        found[name] = {**verdict, "exit": solution.exit_code, "slips": _slips(solution)}
    return found


def _slips(solution: Any) -> list[float]:
    """∫ u1 over the floor of each block, m² (m³ in space)."""
    if solution.solve_result is None:
        return []
    (state,) = solution.examination.states
    right = state.surface.points[:, 0] > 1.5
    scales = solution.problem.scales
    area = state.surface.weights * scales.length ** (scales.dimension - 1)
    parts = area * state.slip[:, 0] * scales.displacement
    comm = solution.problem.domain.mesh.comm
    return [float(comm.allreduce(parts[side].sum())) for side in (~right, right)]


@pytest.fixture(scope="module", params=LONG_RANKS)
def answers(request: pytest.FixtureRequest, folder: Path) -> dict[str, Any]:
    """What `told` says on one, two and three ranks."""
    found: dict[str, Any] = (
        told(folder, MPI.COMM_SELF) if request.param == 1 else on_ranks(request.param, __file__, folder)
    )
    return found


@pytest.mark.parametrize("name", TOLD)
def test_each_block_slides_by_itself(name: str, answers: dict[str, Any]) -> None:
    """λ is the least of the two blocks'; a held block's slip is P δ/γ1, whatever the other one does."""
    case, _, file = name.rpartition("-")
    pushes, found = CASES[case], answers[name]
    worst = max(pushes, key=abs)
    assert found["lambda_held"] == pytest.approx(0.5 * GAMMA / abs(worst), rel=1e-8)
    assert found["lambda_peak"] == pytest.approx(GAMMA / abs(worst), rel=1e-8)
    state = "held" if abs(worst) < 0.5e6 else "metastable" if abs(worst) < 1e6 else "escapes"
    assert (found["state"], found["exit"]) == (state, 3 if state == "escapes" else 0)
    sense = "+" if worst > 0 else "-"
    body = "a" if worst == pushes[0] else "b"
    assert found["direction"] == (None if state == "held" else f'translation along {sense}x of body "{body}"')
    assert len(found["kernel"]) == (6 if file == "plane" else 12)
    assert found["kernel"][:2] == [f'{w} of body "a"' for w in WORDS]
    for push, slip in zip(pushes, found["slips"], strict=False):  # nothing is solved where a block escapes
        if abs(push) < 0.5e6:
            assert slip == pytest.approx(9.0e-6 * push / GAMMA, rel=1e-7)


def test_both_escapes_count_in_the_margin(answers: dict[str, Any]) -> None:
    """Sliding, block a lacks 0.55 - 0.5 and block b 0.6 - 0.5 of 1e6; lengths in units of 3, stress of 8e6."""
    margin = answers["both-metastable-plane"]["margin"]
    assert margin == pytest.approx(-(0.05e6 + 0.1e6) / 8.0e6 / 3.0, rel=1e-8)


def test_bodies_without_regions_of_their_own_are_numbered_from_the_left(folder: Path) -> None:
    verdict = prepare(read_tables(blocks(folder / "nameless.msh", 2, 0.3e6, -2.0e6))).solvability
    assert verdict.direction is not None
    assert verdict.direction.name == "translation along -x of body 2 at (2.5, 0.5)"
    assert verdict.kernel[2].name == "rotation about (0.5, 0.5) of body 1 at (0.5, 0.5)"


def test_bodies_are_numbered_from_the_left_though_the_right_one_lies_lower() -> None:
    one = {"shape": "rectangle", "size": [1.0, 1.0], "cells": [1, 1]}
    domain = {"right": one | {"origin": [2.0, -0.5]}, "left": one}
    table = {"domain": domain, "material": {"model": "plane_stress", "youngs_modulus": E, "poisson_ratio": NU}}
    motions = [mode.name for mode in prepare(read_tables(table)).solvability.kernel]
    assert [name.partition(" of ")[2] for name in motions] == 3 * ['body "left"'] + 3 * ['body "right"']


def test_a_body_of_a_file_is_called_by_its_table(tmp_path: Path) -> None:
    """The regions of its file are regions of it."""
    meshes.make(tmp_path / "square.msh", meshes.GOOD)
    table = blocks(tmp_path / "square.msh", 2, 0.0, 0.0)
    plate = {"shape": "rectangle", "size": [1.0, 0.5], "cells": [2, 1], "origin": [0.0, -0.5]}
    table["domain"] = {"upper": table["domain"], "lower": plate}
    table["boundary"] = {
        "wall": {"on": "lower.bottom", "displacement": [0.0, 0.0]},
        "pull": {"on": "upper.top", "traction": [0.0, 1e6]},
    }
    table["interface"] = {"seam": {"between": ["upper.bottom", "lower.top"], "contact": {"gap": 0.0}}}
    verdict = prepare(read_tables(table)).solvability
    assert verdict.direction is not None
    assert verdict.direction.name == 'translation along +y of body "upper": it lifts off body "lower"'


@pytest.mark.parametrize(
    ("conditions", "left"),
    [
        ({}, 6),
        ({"left_a": [0.0, 0.0]}, 3),
        ({"left_a": [0.0, 0.0], "right_b": [0.0, 0.0]}, 0),
        ({"left_a": [0.0, "free"]}, 4),
        ({"left_a": [0.0, "free"], "bottom_b": ["free", 0.0]}, 2),
    ],
)
def test_the_kernel_is_the_null_space_of_the_matrix(conditions: dict[str, Any], left: int, folder: Path) -> None:
    """‖A y‖ = 0 for each mode, and A has no other null vectors: its dense eigenvalues count them."""
    table = blocks(folder / "nameless.msh", 2, 0.0, 0.0)
    table["boundary"] = {side: {"on": [side], "displacement": u} for side, u in conditions.items()}
    prepared = prepare(read_tables(table))
    problem, modes = prepared.problem, prepared.solvability.kernel
    assert len(modes) == left
    matrix = problem.bulk.matrix()
    dense = matrix.convert("dense").getDenseArray()
    free = np.setdiff1d(np.arange(len(dense)), problem.fixed)
    points = problem.space.tabulate_dof_coordinates() / problem.scales.length
    size = np.linalg.norm(dense, 2)
    for mode in modes:
        field = problem.bodies.motion(points, mode).ravel()
        assert np.abs(field[problem.fixed]).max(initial=0.0) < 1e-12
        assert np.linalg.norm(dense @ field) < 1e-13 * size * np.linalg.norm(field)
    eigenvalues: npt.NDArray[np.float64] = np.linalg.eigvalsh(dense[np.ix_(free, free)])
    assert np.count_nonzero(eigenvalues < 1e-12 * size) == left


def test_a_hinge_is_refused(tmp_path: Path) -> None:
    """Two squares that share a corner have four rigid motions, which no kernel of one body or of two describes."""
    meshes.make(tmp_path / "hinge.msh", meshes.HINGE)
    table = blocks(tmp_path / "hinge.msh", 2, 0.0, 0.0)
    table["boundary"] = {"left": {"on": ["left"], "displacement": [0.0, 0.0]}}
    with pytest.raises(InputError, match=r"at \(1, 1\) two bodies share a vertex but no facet"):
        prepare(read_tables(table))


def test_only_the_body_that_escapes_moves_in_the_field(folder: Path, tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    done = hvi("run", folder / "one-escapes-plane.toml", "--out", tmp_path / "r", "--no-pictures")
    assert done.returncode == 3
    assert summary(tmp_path / "r")["solvability"]["direction"] == 'translation along +x of body "b"'
    grid = pyvista.get_reader(tmp_path / "r" / "displacement.pvd").read()[0]
    right = grid.points[:, 0] > 1.5
    assert np.all(grid["escape_mode"][~right] == 0.0)
    np.testing.assert_allclose(grid["escape_mode"][right], [[1.0, 0.0, 0.0]] * np.count_nonzero(right), atol=1e-12)


if __name__ == "__main__":
    found = told(Path(sys.argv[1]), MPI.COMM_WORLD)
    if MPI.COMM_WORLD.rank == 0:
        print(json.dumps(found))

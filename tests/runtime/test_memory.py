"""How much memory there is, and how much a mesh will need: what cannot be held is refused before it is made."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshes
import pytest
from mpi4py import MPI
from scenes import model

from hvi_fenicsx import InputError, prepare, read_tables
from hvi_fenicsx.mesh.shapes import DomainShape
from hvi_fenicsx.runtime import cost


@pytest.mark.parametrize(
    ("table", "file", "wanted"),
    [
        ("0::/batch/job\n", "batch/job/memory.max", [3.0]),
        ("0::/batch/job\n", "batch/memory.max", [3.0]),
        ("0::/\n", "memory.max", [3.0]),
        ("3:cpu:/job\n", "cpu/job/memory.max", []),
    ],
)
def test_the_limits_of_a_cgroup_and_of_those_around_it_hold(
    table: str, file: str, wanted: list[float], tmp_path: Path
) -> None:
    (tmp_path / "table").write_text(table)
    (tmp_path / "cgroup" / file).parent.mkdir(parents=True)
    (tmp_path / "cgroup" / file).write_text(f"{3 * 2**20}\n")
    (tmp_path / "cgroup" / "cgroup.procs").write_text("max\n")
    assert cost.cgroup_limits(tmp_path / "table", tmp_path / "cgroup") == wanted


SHAPES: dict[str, tuple[dict[str, Any], int, float]] = {
    "cells": ({"shape": "rectangle", "size": [1.0, 1.0], "cells": [30, 30]}, 2, 2 * 31**2),
    "box": ({"shape": "box", "size": [1.0, 1.0, 1.0], "cells": [6, 6, 6]}, 3, 3 * 7**3),
    "mesh_size": ({"shape": "l_shape", "size": [1.0, 1.0], "cut": [0.5, 0.5], "mesh_size": 0.04}, 2, 1200.0),
    "refinements": ({"shape": "file", "file": "m.msh", "refinements": 3}, 2, 64 * 2 * 98.0),
}
"""A domain, its dimension, and about how many unknowns it has."""


@pytest.mark.parametrize("key", SHAPES)
def test_a_mesh_of_any_shape_that_memory_cannot_hold_is_refused(
    key: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At the KB per unknown that were measured (docs/benchmarks.md), less a fifth; with a half more it is made."""
    table, dimension, unknowns = SHAPES[key]
    meshes.make(tmp_path / "m.msh", meshes.GOOD)
    shape = DomainShape.registry[table["shape"]].model_validate(table, context={"folder": tmp_path})
    measured = unknowns * {2: 1.3, 3: 2.6}[dimension] / 1024
    monkeypatch.setattr(cost, "memory_room", lambda comm: 0.8 * measured)
    with pytest.raises(InputError, match=r"domain\.\w+: .* unknowns need .* GB or more; there are"):
        shape.build_hierarchy(MPI.COMM_WORLD, dimension)
    monkeypatch.setattr(cost, "memory_room", lambda comm: 1.5 * measured)
    shape.build_hierarchy(MPI.COMM_WORLD, dimension)


SQUARE = {"shape": "rectangle", "size": [1.0, 1.0], "cells": [30, 30]}
TOGETHER: dict[str, tuple[dict[str, Any], float]] = {
    "solver.degree": (model(30, degree=2), 2 * 61**2),
    "domain": (model(30) | {"domain": {"a": SQUARE, "b": SQUARE | {"origin": [2.0, 0.0]}}, "boundary": {}}, 4 * 31**2),
}


@pytest.mark.parametrize("place", TOGETHER)
def test_what_degree_two_and_several_bodies_take_is_foreseen(place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each body alone, and the mesh at degree 1, have room enough."""
    table, unknowns = TOGETHER[place]
    scene, measured = read_tables(table), unknowns * 1.3 / 1024
    monkeypatch.setattr(cost, "memory_room", lambda comm: 0.8 * measured)
    with pytest.raises(InputError, match=rf"^{place}: .* unknowns need .* GB or more; there are"):
        prepare(scene)
    monkeypatch.setattr(cost, "memory_room", lambda comm: 1.2 * measured)
    prepare(scene)

"""The condensed problem has the energy, the forces and the equilibria of the whole system."""

from __future__ import annotations

import copy
import functools
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from mpi4py import MPI
from runs import LONG_RANKS, on_ranks
from scenes import DELTA, NU, E, Table, block, model, quadratic_linear

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.errors import InputError
from hvi_fenicsx.reduced.condensation import Condensation
from hvi_fenicsx.system.system import System

Array = npt.NDArray[np.float64]
STRONG = quadratic_linear(3e6, DELTA)
SPACE = {"model": "three_dimensional", "youngs_modulus": E, "poisson_ratio": NU}


def pulled(cells: int = 4) -> Table:
    """By displacements: one at a vertex that carries a law, and a wall that is scaled with it."""
    table = model(cells, friction=STRONG, press=2e6)
    table["boundary"]["pull"] = {"on": "right", "displacement": [5e-6, "free"]}
    table["boundary"]["wall"]["displacement"] = [-1e-6, "free"]
    return table


def corner() -> Table:
    """Contact on two sides that meet, adhesion on both, friction on one."""
    table = block(4, friction=STRONG)
    glue = {"law": "graph", "points": [[0, 0], [1e-6, 1e6], [3e-6, 0]], "one_sided": True}
    table["boundary"]["floor"]["adhesion"] = glue
    table["boundary"]["side"] = {"on": "left", "contact": {"gap": 1e-7}, "adhesion": glue}
    return table


def frictionless() -> Table:
    """Contact alone, and no load along the floor: the body slides freely."""
    return block(4, push=0.0)


def in_space() -> Table:
    """The model problem in space: |u_t| has two components, one where the wall holds the other."""
    table = model(2, friction=STRONG)
    table |= {"domain": {"shape": "box", "size": [1.0, 0.5, 1.0], "cells": [2, 1, 2]}, "material": dict(SPACE)}
    table["boundary"]["wall"]["displacement"] = [0.0, "free", "free"]
    table["boundary"]["pull"]["traction"] = [3e6, 1e5, 0.0]
    table["boundary"]["press"]["traction"] = [0.0, 0.0, -1e6]
    return table


def on_springs() -> Table:
    """The same with a spring on |u_t|."""
    table = in_space()
    table["boundary"]["floor"]["friction"] = {"law": "linear_spring", "stiffness": 1e11}
    return table


def slanted() -> Table:
    """The floor is an obstacle that slants, so unknowns have local components."""
    table = model(4, friction=STRONG)
    del table["boundary"]["wall"]
    table["boundary"]["floor"]["contact"] = {"obstacle": {"point": [0.0, 0.0], "normal": [-0.2, 1.0]}}
    return table


SCENES = {f.__name__: f for f in (pulled, corner, frictionless, in_space, on_springs, slanted)} | {
    "wall": functools.partial(model, 4, 6e6, friction=STRONG),
    "block": functools.partial(block, 4, 3e5, friction=STRONG),
}


@functools.cache
def condensed(name: str) -> tuple[System, Condensation]:
    system = prepare(read_tables(SCENES[name]()), MPI.COMM_SELF).system
    return system, Condensation(system)


def samples(condensation: Condensation) -> list[Array]:
    generator = np.random.default_rng(3)
    return [3.0 * generator.standard_normal(condensation.problem.size) for _ in range(2)]


def tractions(condensation: Condensation, x: Array) -> Array:
    """The laws' forces."""
    found = np.zeros_like(x)
    for bonds in condensation.problem.bonds:
        argument = bonds.argument(x)
        size = bonds.weights * bonds.law.right(argument)
        vectors = bonds.signs * x[bonds.unknowns]
        unit = bonds.signs if vectors.shape[1] == 1 else bonds.signs * vectors / argument[:, None]
        np.add.at(found, bonds.unknowns, size[:, None] * unit)
    return found


class Right:
    """A law's right derivative, which is defined everywhere."""

    def __init__(self, law: Any) -> None:
        self.value, self.derivative = law.value, law.right


@pytest.mark.parametrize("name", SCENES)
def test_energies_differ_by_what_those_of_the_whole_body_differ_by(name: str) -> None:
    system, condensation = condensed(name)
    whole, reduced = [], []
    for x in samples(condensation):
        whole.append(system.equations.energy(condensation.expand(x), [Right(t.law) for t in system.terms]))
        reduced.append(condensation.problem.energy(x))
    assert reduced[1] - reduced[0] == pytest.approx(whole[1] - whole[0], rel=1e-9)


@pytest.mark.parametrize("name", SCENES)
def test_forces_are_those_of_the_whole_body(name: str) -> None:
    """Zero at all unknowns that were condensed away; bounds and laws alone hold the others."""
    system, condensation = condensed(name)
    problem, residual = condensation.problem, system.load.duplicate()
    for x in samples(condensation):
        u = condensation.expand(x)
        system.equations.residual(u, residual, [Right(t.law) for t in system.terms])
        whole = np.array(residual.array_r)
        reduced = problem.stiffness @ x - problem.load(1.0) + tractions(condensation, x)
        size = np.max(np.abs(reduced))
        assert np.max(np.abs(np.sort(whole[np.abs(whole) > 1e-9 * size]) - np.sort(reduced[reduced != 0.0]))) < (
            1e-9 * size
        )


@pytest.mark.parametrize("name", ["pulled", "wall"])
def test_the_factor_scales_loads_and_prescribed_displacements(name: str) -> None:
    """Condensed at a factor as the scene with scaled numbers, in the same units."""
    factor, (system, condensation) = 0.4, condensed(name)
    table = copy.deepcopy(SCENES[name]())
    for part in table["boundary"].values():
        for key in {"traction", "displacement"} & part.keys():
            part[key] = [v if v == "free" else factor * v for v in part[key]]
    other = prepare(read_tables(table), MPI.COMM_SELF).system
    reference = Condensation(other)
    scales = [s.problem.scales for s in (system, other)]
    unit, force = (getattr(scales[0], k) / getattr(scales[1], k) for k in ("displacement", "stress"))
    for x in samples(condensation):
        u, same = condensation.expand(x, factor), reference.expand(x * unit)
        assert np.max(np.abs(u.array_r * unit - same.array_r)) < 1e-9 * np.max(np.abs(same.array_r))
        energies = condensation.problem.energy(x, factor), reference.problem.energy(x * unit)
        assert energies[0] * unit * force == pytest.approx(energies[1], rel=1e-9)
        products = condensation.problem.potential(x, factor), reference.problem.potential(x * unit, 1.0)
        assert products[0] * unit * force == pytest.approx(products[1], rel=1e-9)


def test_a_name_that_is_no_load_is_refused() -> None:
    system, _ = condensed("wall")
    with pytest.raises(InputError, match=r"pull\.force.*pull\.traction"):
        Condensation(system, ["pull.force"])


@pytest.mark.parametrize("ranks", LONG_RANKS[1:])
def test_all_ranks_hold_the_problem_of_one(ranks: int) -> None:
    """Its energies and forces, for displacements given by place."""
    alone, together = (on_ranks(n, "tests/system/condensed_ranks.py") for n in (1, ranks))
    assert together["equal"]
    for key in ("energies", "force", "whole"):
        assert together[key] == pytest.approx(alone[key], rel=1e-9)

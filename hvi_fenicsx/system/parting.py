"""How bodies that meet leave each other along a rigid motion, in words."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from mpi4py import MPI

from ..problem.interfaces import Interface
from ..problem.problem import Problem
from ..rigid import Mode
from ..runtime.mpi import agree
from ..typing import Array, Integers

STILL = 1e-6
"""A part of the largest motion that is none."""


def named(problem: Problem, mode: Mode | None) -> Mode | None:
    """A signed motion whose name also says which body leaves which one, and how. Collective.

    Args:
        problem: whose bodies move.
        mode: the motion.
    """
    if mode is None:
        return None
    left: dict[str, list[str]] = {}
    for way, other in _partings(problem, mode):
        left.setdefault(way, []).append(other)
    words = ", ".join(f"{way} {' and '.join(dict.fromkeys(others))}" for way, others in left.items())
    return replace(mode, name=f"{mode.name}: {words}") if words else mode


def _partings(problem: Problem, mode: Mode) -> Iterator[tuple[str, str]]:
    """Where one body moves relative to another: which one and how, and the other. Collective."""
    names = [body.name for body in problem.bodies.single()]
    moved = problem.bodies.motion(np.asarray(problem.points / problem.scales.length), mode)
    largest = _most(problem, np.linalg.norm(moved, axis=1))
    moving = {number for number in range(len(names)) if _speed(problem, moved, number) > STILL * largest}
    for interface in problem.interfaces:
        way = _way(problem, interface, mode, STILL * largest)
        if way is not None:
            first, second = (_body(problem, side.nodes) for side in (interface.first, interface.second))
            who, other = (first, second) if first in moving else (second, first)
            yield f"{'it' if moving == {who} else names[who]} {way}", names[other]


def _way(problem: Problem, interface: Interface, mode: Mode, still: float) -> str | None:
    """How the first side moves relative to the second; None where it does not. Collective."""
    blocks = interface.surface.blocks
    fields = problem.motions_at(blocks, problem.bodies.bodies[mode.body])
    relative = np.einsum("n,mnd->md", np.asarray(mode.coefficients), fields)
    opening = -np.sum(relative * interface.surface.normals, axis=1)
    if _most(problem, np.linalg.norm(relative, axis=1)) <= still:
        return None
    if _most(problem, opening) <= still:
        return "slides off"
    return "lifts off" if -_most(problem, -opening) > still else "comes off"


def _speed(problem: Problem, moved: Array, number: int) -> float:
    """The largest motion of a body. Collective."""
    mine = problem.bodies.number_at(np.arange(len(moved))) == number
    return _most(problem, np.linalg.norm(moved[mine], axis=1))


def _body(problem: Problem, nodes: Integers) -> int:
    """The number of the body of a side. Collective."""
    start, end = problem.space.dofmap.index_map.local_range
    here = nodes[(nodes >= start) & (nodes < end)] - start
    found = agree(problem.domain.mesh.comm, problem.bodies.number_at(here[:1]))
    return int(np.concatenate(found)[0])


def _most(problem: Problem, values: Array) -> float:
    """The largest value of all ranks. Collective."""
    own = float(values.max(initial=-np.inf))
    return float(problem.domain.mesh.comm.allreduce(own, op=MPI.MAX))

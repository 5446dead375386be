"""A problem in the displacements that its laws on a length feel: each unknown times its factor, an opening positive.

The length is then the Euclidean one of its unknowns.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..reduced.condensed_problem import Bonds, CondensedProblem, PrescribedBonds
from ..reduced.condensed_stiffness import DenseStiffness
from ..typing import Array, Integers, Mask
from .vertex_laws import is_straight


def factors(problem: CondensedProblem) -> Array:
    """What the unknowns are multiplied by, (n,); 1 where no law acts on a length.

    Args:
        problem: the problem.
    """
    found = np.ones(problem.size)
    for bonds in problem.bonds:
        if bonds.radial:
            found[bonds.unknowns] = bonds.signs
    return found


def multiplied(problem: CondensedProblem, factors: Array) -> CondensedProblem:
    """The problem in unknowns that are multiplied.

    Args:
        problem: the problem.
        factors: by unknown, positive or negative, (n,).
    """
    if np.all(factors == 1.0) and is_straight(problem):
        return problem
    ends = np.sort(np.stack([problem.lower * factors, problem.upper * factors]), axis=0)
    return replace(
        problem,
        elastic=DenseStiffness(problem.stiffness / np.outer(factors, factors)),
        force=problem.force / factors,
        force_rate=problem.force_rate / factors,
        lower=ends[0],
        upper=ends[1],
        applied=problem.applied / factors,
        bonds=tuple(replace(b, signs=b.signs / factors[b.unknowns]) for b in problem.bonds),
    )


def without_fixed(problem: CondensedProblem) -> tuple[CondensedProblem, Integers]:
    """The same problem on the unknowns that can move, and their numbers, (m,).

    Args:
        problem: the problem; an unknown that shares a law with one that moves stays.
    """
    stays = _stays(problem)
    kept, gone = np.flatnonzero(stays), np.flatnonzero(~stays)
    at, number = problem.lower[gone], np.cumsum(stays) - 1
    pull, inside = problem.stiffness[np.ix_(kept, gone)] @ at, problem.stiffness[np.ix_(gone, gone)]
    held = [0.5 * at @ inside @ at - problem.force[gone] @ at, -problem.force_rate[gone] @ at, 0.0]
    fewer = replace(
        problem,
        elastic=DenseStiffness(problem.stiffness[np.ix_(kept, kept)]),
        force=problem.force[kept] - pull,
        force_rate=problem.force_rate[kept],
        lower=problem.lower[kept],
        upper=problem.upper[kept],
        bonds=tuple(_kept(b, stays[b.unknowns[:, 0]], number) for b in problem.bonds),
        prescribed_bonds=(*problem.prescribed_bonds, *_fixed(problem, stays)),
        constant=problem.constant + np.array(held),
        applied=problem.applied[:, kept],
        applied_constant=problem.applied_constant + np.append(problem.applied[:, gone] @ at, 0.0),
        points=problem.points[kept],
        parts=tuple(problem.parts[i] for i in kept),
    )
    return fewer, kept


def _stays(problem: CondensedProblem) -> Mask:
    found = np.asarray(problem.lower != problem.upper)
    for bonds in problem.bonds:
        moving = found[bonds.unknowns].any(axis=1)
        found[bonds.unknowns[moving]] = True
    return found


def _kept(bonds: Bonds, here: Mask, number: Integers) -> Bonds:
    return replace(
        bonds,
        unknowns=number[bonds.unknowns[here]],
        signs=bonds.signs[here],
        weights=bonds.weights[here],
        points=bonds.points[here],
    )


def _fixed(problem: CondensedProblem, stays: Mask) -> Iterator[PrescribedBonds]:
    """The laws of the unknowns that are left out."""
    x: Array = np.where(stays, 0.0, problem.lower)
    for bonds in problem.bonds:
        out = ~stays[bonds.unknowns[:, 0]]
        arguments = np.array([bonds.argument(x)[out], np.zeros(np.count_nonzero(out))])
        yield PrescribedBonds(law=bonds.law, weights=bonds.weights[out], arguments=arguments)

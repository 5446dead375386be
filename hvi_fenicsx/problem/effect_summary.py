"""What each effect in force adds to a problem, read off its contribution: terms, bounds, unknowns, output, solver.

No effect states any of this itself, so a user's own effect has a summary like the program's.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..effects import BoundaryLaw, Contribution, Direction, Effect, Place
from ..laws import Superpotential, describe
from ..typing import together
from .problem import Problem
from .scaling import PlacedContribution

Role = dict[str, Any]
"""One effect's role, ready for JSON:

    place: where it stands in the scene: "boundary", "body" or "material".
    drive: how it drives the body: "load", "kinematic" or "resistance".
    meaning: what it is, in a sentence or two.
    label: the same in a few words.
    traction: a load on its part by component, numbers or formulas, N/m²; empty: none.
    pressure: a load against its part, a number or a formula, N/m²; None: none.
    prescribed: the displacement components, from 0, that it prescribes.
    bounded: whether it bounds the normal displacement.
    obstacle: the unit vector towards a flat obstacle, where it has one.
    laws: the displacement that each of its laws acts on, the law as a scene writes it, and the multipliers of its
        tractions and of its lengths, numbers or formulas.
"""
_BOUNDS = ("gap", "sigma_n", "contact")


@dataclass(frozen=True, slots=True, kw_only=True)
class EffectSummary:
    """What one effect adds.

    Attributes:
        effect: its key.
        where: its place: a part or region, None for the whole body.
        adds: its term, in words and symbols.
        terms: what is assembled for it.
        bounds: number of bounded displacements.
        unknowns: number of displacements that it brings or, negative, takes away.
        output: what the results hold because of it.
        solver: what it asks of the solver.
        role: what it does, for those who report or draw it.
    """

    effect: str
    where: str | None
    adds: str
    terms: str
    bounds: int
    unknowns: int
    output: list[str]
    solver: str
    role: Role


def summaries(problem: Problem) -> list[EffectSummary]:
    """The summaries of all effects, in the scene's order. Collective."""
    first = next((i for i, (_, e, _) in enumerate(problem.contributions) if e.place is Place.MATERIAL), None)
    return [_summary(problem, made, brings=i == first) for i, made in enumerate(problem.contributions)]


def _summary(problem: Problem, made: PlacedContribution, *, brings: bool) -> EffectSummary:
    where, effect, contribution = made
    total = problem.space.dofmap.index_map.size_global * problem.space.dofmap.index_map_bs
    return EffectSummary(
        effect=effect.key,
        where=where,
        adds=effect.term,
        terms=", ".join(_terms(contribution)) or "none",
        bounds=_bounded(problem, where) if contribution.bounds else 0,
        unknowns=total if brings else -_prescribed(problem, where, contribution),
        output=list(_output(effect, contribution)),
        solver=_solver(contribution),
        role=role_of(effect, contribution),
    )


def _terms(contribution: Contribution) -> Iterator[str]:
    parts = {
        "bilinear": contribution.bilinear,
        "averaged": contribution.averaged,
        "linear": (*contribution.linear, *contribution.strains),
        "law": contribution.laws,
    }
    yield from (f"{len(found)} {name}" for name, found in parts.items() if found)


def _bounded(problem: Problem, part: str | None) -> int:
    """Vertices of a part, over all ranks. Collective."""
    return int(problem.comm.allreduce(sum(len(s.blocks) for s in problem.surfaces if s.part == part)))


def _prescribed(problem: Problem, part: str | None, contribution: Contribution) -> int:
    """Displacements that its conditions take away, over all ranks. Collective."""
    own = [one.dofs for one in problem.prescribed if one.part == part] if contribution.conditions else []
    return int(problem.comm.allreduce(np.intersect1d(together(own), problem.fixed_here).size))


def _output(effect: Effect, contribution: Contribution) -> Iterator[str]:
    if effect.place is Place.MATERIAL:
        yield "displacement"
    if contribution.bounds:
        yield from _BOUNDS
    for law in contribution.laws:
        yield from ("friction_t", "branch_t") if law.direction.tangential else ()
        yield from ("sigma_n", "branch_n") if law.direction.normal else ()


def _solver(contribution: Contribution) -> str:
    if any(not law.law.is_linear or law.direction is Direction.SEPARATION for law in contribution.laws):
        return "branch iteration"
    return "bounds" if contribution.bounds else "linear"


def table(found: Sequence[EffectSummary]) -> Iterator[str]:
    """The summaries as lines of aligned columns."""
    rows = [("effect", "terms", "bounds", "unknowns", "output", "solver")]
    for one in found:
        bounds = f"{one.bounds:,}" if one.bounds else "none"
        unknowns = f"{one.unknowns:+,}" if one.unknowns else "none"
        outputs = ", ".join(one.output) or "none"
        rows.append((f"{one.effect} on {one.where or 'the body'}", one.terms, bounds, unknowns, outputs, one.solver))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        yield "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()


def role_of(effect: Effect, contribution: Contribution) -> Role:
    """The role of an effect.

    Args:
        effect: the effect.
        contribution: what it added to the problem.
    """
    load = effect.surface_load()
    return {
        "place": effect.place.value,
        "drive": effect.drive.name.lower(),
        "meaning": effect.meaning(),
        "label": effect.label or effect.key.replace("_", " "),
        "traction": [f.source for f in load.components] if load else [],
        "pressure": load.pressure.source if load and load.pressure else None,
        "prescribed": sorted({c.component for c in contribution.conditions}),
        "bounded": bool(contribution.bounds),
        "obstacle": next((b.towards.constant for b in contribution.bounds if b.towards is not None), None),
        "laws": [_law(brought) for brought in contribution.laws],
    }


def _law(brought: BoundaryLaw) -> dict[str, Any]:
    return {
        "direction": brought.direction.value,
        "law": _table(brought.law),
        "multiplier": brought.multiplier.source,
        "length_multiplier": brought.length_multiplier.source,
    }


def _table(law: Superpotential) -> dict[str, Any]:
    """The table that a scene would have; its name alone where a parameter is not plain data."""
    try:
        table = describe(law)
        json.dumps(table)
    except (TypeError, ValueError, AttributeError):
        return {"law": law.name}
    return table

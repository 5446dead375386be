"""What the program tells in words: the scene, whether a solution exists, what was found and how sure it is."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from .solution import Prepared, Solution
from .solvers.linear import LinearSettings


def heading(prepared: Prepared, ranks: int) -> Iterator[str]:
    """The scene, its size and its existence."""
    title = prepared.scene.title or "untitled"
    yield f"{title}: {prepared.system.dofs:,} unknowns on {ranks} rank{'s'[: ranks - 1]}"
    yield f"existence: {existence(prepared)}"


def existence(prepared: Prepared) -> str:
    """One line on kernel, state, margin and load factors."""
    s = prepared.solvability
    kernel = ", ".join(mode.words for mode in s.kernel) or "none"
    parts = [f"{s.state}; rigid motions that the supports leave: {kernel}"]
    if s.direction is not None:
        parts.append(f"escape by {s.direction.words}")
    if s.margin is not None:
        parts.append(f"margin {s.margin:.3g}")
    for name, factor in (("held up to load factor", s.lambda_held), ("peak at load factor", s.lambda_peak)):
        if math.isfinite(factor):
            parts.append(f"{name} {factor:.6g}")
    return "; ".join(parts)


def effects(prepared: Prepared) -> Iterator[str]:
    """Each effect in force with what it adds, and the solver that follows."""
    for placed in prepared.scene.effects():
        yield f"effect: {placed.effect.key} on {placed.where or 'the body'}: {placed.effect.term}"
    yield f"solver: {solver(prepared)}"


def solver(prepared: Prepared) -> str:
    """Which solver the effects call for."""
    problem, kind = prepared.problem, LinearSettings.choose(prepared.system, prepared.scene.solver.linear_solver).kind
    linear = {"lu": "MUMPS", "gamg": "CG with GAMG"}[kind]
    if problem.terms and problem.bounds:
        return f"branch iteration over SNES VI (reduced space), {linear}"
    if problem.terms:
        return f"branch iteration over Newton, no bounds, {linear}"
    return f"SNES VI (reduced space), a convex programme, {linear}" if problem.bounds else f"one linear solve, {linear}"


def outcome(solution: Solution) -> Iterator[str]:
    """What was found and how sure it is."""
    yield f"result: {solution.reason}"
    if solution.examined is None or solution.solved is None:
        return
    c, counts = solution.examined.certificate, solution.solved.counts
    yield (
        f"certificate ({c.tolerance:g}): equilibrium {c.equilibrium:.1e}, penetration {c.penetration:.1e}, tension "
        f"{c.tension:.1e}, complementarity {c.complementarity:.1e}, inclusion {c.inclusion:.1e}; {c.second_order}"
    )
    if solution.scene.solver.smoothing is not None:
        away = solution.examined.smoothing_error * solution.problem.scales.stress
        yield f"smoothing: -σ_t is up to {away:.3g} N/m² from what the unsmoothed law gives there"
    energy = solution.examined.energy * solution.problem.scales.energy
    unit = "J/m" if solution.problem.scales.dimension == 2 else "J"
    yield (
        f"energy {energy:.10g} {unit}; {counts.branch} branch steps, {counts.newton} Newton steps, {counts.linear} "
        f"linear iterations, {solution.timer.seconds['setup'] + solution.timer.seconds['solve']:.2f} s"
    )


def as_data(prepared: Prepared) -> dict[str, Any]:
    """The report of ``check --json``."""
    return {
        "scene": prepared.scene.title,
        "dofs": prepared.system.dofs,
        "solvability": prepared.solvability.summary(),
        "effects": [
            {"effect": p.effect.key, "where": p.where, "adds": p.effect.term} for p in prepared.scene.effects()
        ],
        "solver": solver(prepared),
    }

"""``summary.json``: the run in numbers (docs/results.md)."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from ..problem import effect_summary
from ..runtime import cost, manifest
from ..runtime.mpi import largest
from ..workflow import Preparation, Solution


def summary(solution: Solution) -> dict[str, Any]:
    """All of ``summary.json``; null for infinite or absent. Collective; the same on all ranks."""
    problem, solved, examination = solution.problem, solution.solve_result, solution.examination
    wanted, forces, borne = solution.scene.solver, solution.forces, solution.last_borne
    return plain(
        {
            **common(solution, solution.dofs),
            "converged": solution.converged,
            "reason": solution.reason,
            "exit_code": solution.exit_code,
            "method": solved.method if solved else None,
            "smoothing": wanted.smoothing,
            "epsilon": solution.epsilon,
            "iterations": asdict(solved.counts) | {"levels": solved.levels} if solved else None,
            "energy": examination.energy * problem.scales.energy if examination else None,
            "contact": _contact(solution),
            "mode_mixity": _mode_mixity(solution),
            "resultants": None
            if forces is None
            else {name: force * problem.scales.force for name, force in forces.resultants(problem.comm).items()},
            "certificate": asdict(solution.certificate) if solution.certificate else None,
            "last_borne": {"factor": borne.factor, "certificate": asdict(examination.certificate)}
            if borne and examination
            else None,
            "obstacle": solution.obstacle.summary() if solution.obstacle else None,
            "uniqueness": asdict(solution.uniqueness) if solution.uniqueness else None,
            "estimate": _estimate(solution),
            "accuracy": None,
            "warnings": list(solution.warnings),
            "effects": [asdict(summary) for summary in effect_summary.summaries(problem)],
            "scales": {key: getattr(problem.scales, key) for key in ("length", "stress", "displacement", "energy")},
        }
    )


def common(of: Solution | Preparation, dofs: int) -> dict[str, Any]:
    """The entries that every summary has. Collective; the same on all ranks.

    Args:
        of: what was found, or the scene, assembled.
        dofs: the number of unknowns.
    """
    comm = of.problem.comm
    return {
        "scene": of.scene.title,
        "dofs": dofs,
        "ranks": comm.size,
        "solvability": plain(of.solvability.summary()),
        "time": {name: largest(comm, value) for name, value in of.timer.report().items()},
        "peak_memory_mb": cost.peak_memory(comm),
        "versions": manifest.versions(),
    }


def _estimate(solution: Solution) -> dict[str, float | bool] | None:
    """Norms in (J/m)^½ or J^½; ``relative`` is the total over the energy norm; ``coarse``: the numbers are rough."""
    if solution.estimate is None:
        return None
    unit = math.sqrt(solution.problem.scales.energy)
    norms = {k: v if k == "relative" else v * unit for k, v in solution.estimate.as_dict().items()}
    return norms | {"coarse": solution.estimate.coarse}


def _contact(solution: Solution) -> dict[str, Any] | None:
    """Over all parts with contact: vertices, those closed, largest gap and penetration (m), resultant (N/m or N)."""
    examination, scales = solution.examination, solution.problem.scales
    comm = solution.problem.comm
    if examination is None or not comm.allreduce(len(solution.problem.bounds)):
        return None
    states = [s for s in examination.states if s.bounds is not None]
    gaps = scales.displacement * np.concatenate([np.empty(0), *(s.gap[np.isfinite(s.gap)] for s in states)])
    resultant = comm.allreduce(sum(s.resultant for s in states))
    return {
        "vertices": comm.allreduce(sum(len(s.gap) for s in states)),
        "active": comm.allreduce(sum(int(np.count_nonzero(s.contact)) for s in states)),
        "max_gap": largest(comm, float(np.max(gaps, initial=0.0))),
        "max_penetration": largest(comm, float(np.max(0.0 - gaps, initial=0.0))),
        "penetration_between_nodes": None if (dip := examination.between_nodes) is None else dip * scales.displacement,
        "resultant": resultant * scales.force,
    }


def _mode_mixity(solution: Solution) -> dict[str, float] | None:
    """By part with a law of both modes: the share of the slip in ∫ δ² ds; null without such a law. Collective."""
    examination, comm = solution.examination, solution.problem.comm
    found = {}
    for state in examination.states if examination else ():
        if (law := state.of_both_modes) is not None:
            squares = state.surface.weights * (law.term.stretch * law.argument) ** 2
            slip, whole = comm.allreduce(np.array([np.nansum(squares * law.slip_share), squares.sum()]))
            found[state.surface.part] = float(slip / whole) if whole > 0.0 else math.nan
    return found or None


def plain(value: Any) -> Any:
    """What JSON can say: no infinities, no NumPy."""
    if isinstance(value, dict):
        return {k: plain(v) for k, v in value.items()}
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value

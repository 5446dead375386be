"""The lines of the terminal: the scene, whether a solution exists, what was found and how sure it is."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from .certify.certificate import Examination
from .estimate.estimator import Estimate
from .model import PathTable
from .paths.load_path import LoadPath
from .problem import effect_summary
from .reduced import loading
from .rigid import LoadFactors, Mode
from .runtime.log import percent
from .solvers import nested_iteration, quadratic
from .solvers.convergence import Counts
from .workflow import Preparation, Solution

NO_HISTORY = (
    "a single run has none: it finds an equilibrium at this load, and a joint that is unloaded heals; `hvi path` "
    "follows the load, and its bonds remember"
)
_OTHERS = {"unique": "there is none", "lowest": "none has a lower energy", "unknown": "unknown"}
"""What is known about them, by the state of :class:`.Uniqueness`."""
_LISTED = 3
"""So many rigid motions are named one by one; of more, only the number is given."""


def heading(prepared: Preparation, ranks: int) -> Iterator[str]:
    """The scene, its size, whether a solution exists, and the warnings before the solve.

    Args:
        prepared: the scene, assembled.
        ranks: on which it is solved.
    """
    title = prepared.scene.title or "untitled"
    yield f"{title}: {prepared.system.dofs:,} unknowns on {ranks} {'rank' if ranks == 1 else 'ranks'}"
    yield f"existence: {existence(prepared)}"
    yield from warnings(prepared.warnings)


def warnings(found: Iterable[str]) -> Iterator[str]:
    """Warnings, a line each."""
    return (f"warning: {warning}" for warning in found)


def existence(prepared: Preparation) -> str:
    """One line on kernel, state, margin and load factors."""
    s = prepared.solvability
    trouble = f" ({s.trouble})" if s.trouble else ""
    parts = [f"{s.state}{trouble}; rigid motions that the supports leave: {motions(s.kernel)}"]
    if s.direction is not None:
        parts.append(f"escape by {s.direction.name}")
    if s.margin is not None:
        parts.append(f"margin {s.margin:.3g}")
    if s.free:
        parts.append(
            f"undetermined, neither held nor driven: {motions(s.free)} (the solution that moves least is returned)"
        )
    if s.never_held:
        parts.append("held at no load factor")
    if math.isfinite(s.held_from) and not s.never_held and s.held_from > 0.0:
        parts.append(f"held above load factor {s.held_from:.6g}")
    for name, factor in (("held up to load factor", s.lambda_held), ("peak at load factor", s.lambda_peak)):
        if math.isfinite(factor):
            parts.append(f"{name} {factor:.6g}")
    return "; ".join(parts)


def motions(found: Sequence[Mode]) -> str:
    """Rigid motions: a few by their names, more by their number."""
    if len(found) <= _LISTED:
        return ", ".join(mode.name for mode in found) or "none"
    return f"{len(found)} (`hvi check --json` lists them)"


def load_factors(factors: Mapping[str, LoadFactors]) -> Iterator[str]:
    """One line on each load: between which factors of it the body is held, the others as they are."""
    for name, f in factors.items():
        mode, peak_mode = (f" ({motion.name})" if motion else "" for motion in (f.mode, f.peak_mode))
        yield f"load {name} alone: {_held(f)}{mode}; {_peak(f.peak)}{peak_mode}"


def _held(f: LoadFactors) -> str:
    """Between which factors a body is held."""
    if f.never_held:
        return "held at no factor"
    ends = [f"above {f.held_from:.6g}"] if math.isfinite(f.held_from) else []
    ends += [f"up to {f.held:.6g}"] if math.isfinite(f.held) else []
    return f"held at factors {' and '.join(ends)}" if ends else "held at any factor"


def _peak(factor: float) -> str:
    """The factor of peak strength."""
    if math.isfinite(factor):
        return f"peak at {factor:.6g}"
    return "no peak" if factor > 0 else "beyond the peak at every factor"


def effects(prepared: Preparation) -> Iterator[str]:
    """The effects in force with what each adds, and the solver that follows. Collective."""
    found = effect_summary.summaries(prepared.problem)
    yield from (f"effect: {one.effect} on {one.where or 'the body'}: {one.adds}" for one in found)
    yield from effect_summary.table(found)
    yield f"solver: {solver(prepared)}"


def solver(prepared: Preparation) -> str:
    """The solver that the effects call for."""
    kind = nested_iteration.linear_settings(prepared.system, prepared.options).kind
    linear = {
        "lu": "MUMPS",
        "gamg": "CG with GAMG",
        "mg": "CG with geometric multigrid on the mesh hierarchy",
        "mixed": "MINRES for displacements and pressures with geometric multigrid on the mesh hierarchy",
    }[kind]
    bounds = "" if prepared.problem.bounds else ", no bounds"
    return f"{quadratic.choose(prepared.options, prepared.system).description}{bounds}, {linear}"


def outcome(solution: Solution) -> Iterator[str]:
    """What was found and how sure it is."""
    yield f"result: {solution.reason}"
    if not solution.converged:
        yield from _what_next(solution.solvability.state)
    if solution.examination is None or solution.solve_result is None:
        return
    if solution.obstacle is not None:
        yield f"obstacle of {solution.obstacle.part}: {solution.obstacle}"
    of = "" if (last := solution.last_borne) is None else f" of the state at load factor {last.factor:.6g}"
    yield f"certificate{of} ({solution.examination.certificate.tolerance:g}): {solution.examination.certificate}"
    if solution.uniqueness is not None:
        yield f"other equilibria: {_OTHERS[solution.uniqueness.state]}; {solution.uniqueness.why}"
    yield from _deviations(solution, solution.examination)
    yield _cost(solution, solution.examination.energy, solution.solve_result.counts)


def _what_next(state: str) -> Iterator[str]:
    """Which commands may tell more, by the state of existence of a scene without a certified solution."""
    if state in ("metastable", "escapes"):
        yield "`hvi path SCENE` follows the load to the last state that is borne, and beyond"
    if state == "metastable":
        yield "`hvi equilibria SCENE` looks for all equilibria, and can prove that there is none"


def _deviations(solution: Solution, examination: Examination) -> Iterator[str]:
    """What rounding, smoothing and the mesh leave of it."""
    c = examination.certificate
    if c.rounding is not None and c.rounding > c.tolerance:
        yield (
            f"tolerance {c.tolerance:g} is below the rounding errors at this displacement: {c.rounding:.1e} was asked "
            f"for instead (of the net force {c.tolerance:g})"
        )
    if solution.scene.solver.smoothing is not None:
        away = examination.smoothing_error * solution.problem.scales.stress
        yield f"smoothing: -σ_t is up to {away:.3g} N/m² from what the unsmoothed law gives there"
    if solution.estimate is not None:
        yield error(solution.estimate)
        if solution.estimate.coarse:
            yield "`hvi run SCENE --accuracy 0.05` lets the program refine the coarse mesh"


def _cost(solution: Solution, energy: float, counts: Counts) -> str:
    """The energy, and what it took to find it."""
    unit, times = "J/m" if solution.problem.dimension == 2 else "J", solution.timer.seconds
    return (
        f"energy {energy * solution.problem.scales.energy:.10g} {unit}; {counts.branch} branch steps, {counts.newton} "
        f"Newton steps, {counts.linear} linear iterations, {times['setup'] + times['solve']:.2f} s"
    )


def error(estimate: Estimate) -> str:
    """One line on the estimated error and its parts."""
    norm = estimate.energy_norm or 1.0
    parts = {name: getattr(estimate, name) / norm for name in ("discretisation", "smoothing", "algebraic")}
    split = ", ".join(f"{name} {share(value)}" for name, value in parts.items())
    return f"estimated error {share(estimate.total / norm)} in the energy norm ({split})"


def share(value: float) -> str:
    """A ratio as a percentage, where it is not too small for one."""
    if not math.isfinite(value):
        return "unknown"
    return percent(value) if value >= 1e-5 or value == 0 else f"{value:.0e}"


def as_data(prepared: Preparation, factors: Mapping[str, LoadFactors]) -> dict[str, Any]:
    """What ``check --json`` prints. Collective.

    Args:
        prepared: the scene, assembled.
        factors: of each load that was asked for.
    """
    return {
        "scene": prepared.scene.title,
        "dofs": prepared.system.dofs,
        "solvability": prepared.solvability.summary(),
        "load_factors": {name: found.summary() for name, found in factors.items()},
        "effects": [asdict(summary) for summary in effect_summary.summaries(prepared.problem)],
        "solver": solver(prepared),
        "warnings": list(prepared.warnings),
    }


def history(prepared: Preparation) -> Iterator[str]:
    """That a single run has none, where a law can break; and the load path that the scene asks for.

    Args:
        prepared: the scene, assembled.
    """
    if any(not term.is_linear for term in prepared.problem.terms):
        yield f"history: {NO_HISTORY}"
    if (wanted := prepared.scene.path) is not None:
        yield from path_wanted(wanted, wanted.scaled or loading.load_names(prepared.system))


def path_wanted(wanted: PathTable, scaled: Sequence[str]) -> Iterator[str]:
    """What a load path is of, and what it takes bonds for.

    Args:
        wanted: the scene's table.
        scaled: the names of what the factor multiplies.
    """
    way = " → ".join(f"{factor:g}" for factor in (0.0, *wanted.to))
    yield f"path: the factor goes {way} and multiplies {', '.join(scaled)}"
    kind = "unload along the secant, and what is broken stays broken" if wanted.memory else "heal on unloading"
    then = "on to the next stable state" if wanted.follow == "stable" else "the path itself, also where it is unstable"
    yield f"path: at a limit point {then}; bonds {kind}"


def path_outcome(path: LoadPath) -> Iterator[str]:
    """What was found of a load path.

    Args:
        path: the path.
    """
    yield f"result: {path.headline}"
    unit = "N/m" if path.dimension == 2 else "N"
    for part in path.parts:
        row = path.strongest(part)
        if not any(path.rows[row].forces[part]):  # a moment
            continue
        force = ", ".join(f"{f:.6g}" for f in path.rows[row].forces[part])
        yield f"largest force on {part}: ({force}) {unit}, at factor {path.rows[row].factor:.6g} (row {row})"
    released = [f"{path.rows[n].factor:.6g}" for n in path.jumps]
    jumps = f", jumps at {', '.join(released[:6])}" + (" ..." if len(released) > 6 else "") if released else ""
    passed = len(path.rows) - path.uncertified
    yield f"{len(path.rows)} rows, {len(path.folds)} limit points{jumps}; certified: {passed} of {len(path.rows)}"

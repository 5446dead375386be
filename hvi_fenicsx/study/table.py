"""A finished study in numbers: one row for each point, the Pareto front of each quantity, its tables and sentences."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..accuracy.quantity_base import ORDERS
from ..errors import ExitCode, InputError
from ..model import SolverTable
from ..runtime.log import percent
from ..runtime.manifest import __version__, versions
from ..schema import unknown
from .errors import NORMS, Errors
from .plan import Plan, Point

PHASES = ("mesh", "assembly", "setup", "solve", "certificate")
"""What a point costs: compilation is paid once for all, and a study writes no results."""

_LEAST = np.finfo(float).eps
"""Relative: no smaller error can be measured."""
RESOLVED = 2
"""An error tells an order of convergence if it is so many times the reference's own."""
_TARGETS = (0.1, 0.01, 0.001)
"""The relative errors whose cost is named."""
_HEADLINES = ("energy_norm", "u_t_l2", "friction_l1", "pressure_l1")


@dataclass(frozen=True)
class Certainty:
    """How well the reference is known in one quantity.

    Attributes:
        error: the reference's own relative error; None where it is not known.
        order: in h, measured on the next coarser levels; None where it is not known.
    """

    error: float | None
    order: float | None


def certainty(coarser: Sequence[Errors]) -> Mapping[str, Certainty]:
    """How well the reference is known, by quantity, from two coarser levels by Richardson's extrapolation.

    With e' and e'' their errors against it, and errors that fall as C hᵖ, e''/e' = 2ᵖ + 1, and its own is e'/(2ᵖ - 1)
    (Roache 1998, *Verification and Validation in Computational Science and Engineering*). In the energy norm the
    differences of nested Galerkin solutions are orthogonal, so the same holds of the squares, with 4ᵖ for 2ᵖ.

    Args:
        coarser: the errors of the next coarser levels against the reference, finest first.
    """
    return {key: _certainty([e[key] for e in coarser], 2 if key == "energy_norm" else 1) for key in NORMS}


def _certainty(errors: Sequence[float | None], power: int) -> Certainty:
    known = [e**power for e in errors if e is not None]
    if not known or known[0] <= _LEAST**power:
        return Certainty(_LEAST if known else None, None)
    order = math.log2(known[1] / known[0] - 1.0) / power if len(known) > 1 and known[1] > known[0] else None
    believed = float(np.clip(ORDERS[0] if order is None else order, *ORDERS))
    return Certainty(max(_LEAST, (known[0] / (2.0 ** (power * believed) - 1.0)) ** (1.0 / power)), order)


class Row(SimpleNamespace):
    """A point: its setting, what it cost, how far off it is. All but properties is its entry in ``study.json``.

    Attributes:
        point: its name.
        mesh: as people name it.
        degree: of the elements.
        h: the mesh width, m.
        smoothing: kind of the smoothing; None for the exact law.
        epsilon: width of the smoothing, relative; None for the exact law.
        epsilon_absolute: width of the smoothing, N/m, where the scene says it so.
        method: of the solver table.
        linear_solver: of the solver table.
        tolerance: of the solver table.
        dofs: unknowns.
        converged: whether the solution is certified.
        reason: why the run ended as it did.
        exit_code: of the run.
        energy: J/m or J.
        iterations: by kind.
        seconds: median cost without compilation and output.
        runs: that the median is of.
        phases: median cost by phase, s.
        errors: relative, against the reference.
        epsilon_part: how far the point is from the exact law on its own mesh; None: it is exact, or that point failed.
        beyond_reference: quantities whose error is below the reference's own.
    """

    @property
    def law(self) -> str:
        """The law in words: exact, or how it is smoothed."""
        if self.smoothing is None:
            return "exact law"
        width = f"{self.epsilon:.3g}" if self.epsilon_absolute is None else f"{self.epsilon_absolute:g} N/m"
        return f"{'' if self.smoothing == 'quadratic' else f'{self.smoothing}, '}ε = {width}"

    @property
    def way(self) -> tuple[str, str, float]:
        """How it is solved, but for law and degree."""
        return self.method, self.linear_solver, self.tolerance

    @property
    def text(self) -> str:
        """The setting in words; what is as the program chooses is left out."""
        parts = [self.mesh, *(["degree 2"] if self.degree == 2 else []), self.law]
        parts += [self.method] if self.method != "auto" else []
        parts += [f"tolerance {self.tolerance:g}"] if self.tolerance != SolverTable().tolerance else []
        parts += [self.linear_solver] if self.linear_solver != "auto" else []
        return ", ".join(parts)

    def error(self, quantity: str) -> float | None:
        """Relative; None where there is none.

        Args:
            quantity: one of ``NORMS``.

        Raises:
            InputError: there is no such quantity.
        """
        if quantity not in NORMS:
            raise InputError(unknown("quantity", quantity, NORMS))
        return self.errors[quantity] if self.converged and self.errors else None


@dataclass(frozen=True, kw_only=True, repr=False)
class Study:
    """A finished study.

    Attributes:
        title: of the scene.
        rows: the points, cheapest mesh first.
        own: the scene's own setting.
        exact: the exact law on the scene's mesh.
        certain: how well the reference is known, by quantity.
        reference: its row.
        coarser: errors of the next coarser levels against the reference, finest first.
        left_out: combinations that were not run.
        ranks: that solved the points.
    """

    title: str
    rows: tuple[Row, ...]
    own: Row
    exact: Row
    certain: Mapping[str, Certainty]
    reference: Row
    coarser: tuple[Errors, ...]
    left_out: tuple[str, ...]
    ranks: int

    def headlines(self) -> list[str]:
        """The quantities that are shown: energy norm, slip, and last -σ_t (-σ_n where there is no friction)."""
        known = [q for q in _HEADLINES if any(r.error(q) is not None for r in self.rows)]
        return [q for q in known if q != "pressure_l1" or "friction_l1" not in known]

    def claimed(self, row: Row, quantity: str) -> float | None:
        """The error that can be claimed: not less than the reference's own.

        Args:
            row: the point.
            quantity: one of ``NORMS``.
        """
        error = row.error(quantity)
        return None if error is None else max(error, self.certain[quantity].error or 0.0)

    def front(self, quantity: str) -> list[Row]:
        """The points that nothing cheaper is as accurate as, cheapest first; errors count with two digits."""
        known = [
            (r.seconds or 0.0, float(f"{e:.1e}"), r) for r in self.rows if (e := self.claimed(r, quantity)) is not None
        ]
        found, best = list[Row](), math.inf
        for _, error, row in sorted(known, key=lambda t: t[:2]):
            if error < best:
                best = error
                found.append(row)
        return found

    def order(self, quantity: str, like: Row) -> float | None:
        """The order in h of the error, by the scene's own method, from the two finest meshes that are resolved.

        Args:
            quantity: one of ``NORMS``.
            like: whose law and degree the points have.
        """
        own, least = self.own, RESOLVED * (self.certain[quantity].error or 0.0)
        alike = [r for r in self.rows if (r.law, r.degree, r.way) == (like.law, like.degree, own.way)]
        errors = {r.h: e for r in alike if r.h is not None and (e := r.error(quantity)) is not None and e > least}
        if len(errors) < 2:
            return None
        (h, near), (coarser, far) = sorted(errors.items())[:2]
        return math.log(near / far) / math.log(h / coarser)

    def share_of_epsilon(self, quantity: str) -> float | None:
        """ε's part of the scene's own error: its distance from the exact law on its mesh, beside that law's error."""
        part, bare = (self.own.epsilon_part or {}).get(quantity), self.exact.error(quantity)
        return None if part is None or bare is None or part + bare == 0.0 else part / (part + bare)

    @property
    def sentences(self) -> tuple[str, ...]:
        """What the study says in words that a person can act on."""
        return tuple(_sentences(self))

    def __repr__(self) -> str:
        return "\n".join(self.sentences)

    def as_data(self) -> dict[str, Any]:
        """All of ``study.json`` (docs/study.md)."""
        return {
            "scene": self.title,
            "version": __version__,
            "ranks": self.ranks,
            "sentences": self.sentences,
            "quantities": {key: description for key, (description, _) in NORMS.items()},
            "headlines": self.headlines(),
            "own": self.own.point,
            "exact": self.exact.point,
            "share_of_epsilon": {q: self.share_of_epsilon(q) for q in self.headlines()},
            "reference": {
                **vars(self.reference),
                "certainty": {q: asdict(known) for q, known in self.certain.items()},
                "errors_of_coarser_meshes": list(self.coarser),
            },
            "fronts": {q: [r.point for r in self.front(q)] for q in NORMS},
            "points": [vars(r) for r in self.rows],
            "left_out": list(self.left_out),
            "versions": versions(),
        }

    def lines(self) -> list[dict[str, Any]]:
        """The lines of ``study.csv``, one for each point; errors are in columns ``error_QUANTITY``."""
        found = []
        for data in map(vars, self.rows):
            line = {key: value for key, value in data.items() if key not in _NESTED}
            for name, keys in _NESTED.items():
                prefix = "error" if name == "errors" else name
                line |= {f"{prefix}_{key}": (data[name] or {}).get(key) for key in keys}
            found.append({**line, "beyond_reference": " ".join(data["beyond_reference"])})
        return found


_NESTED = {
    "phases": PHASES,
    "iterations": ("newton", "linear", "levels", "branch"),
    "errors": NORMS,
    "epsilon_part": NORMS,
}
"""The columns that a column of a row becomes."""


def evaluate(plan: Plan, known: Mapping[str, Mapping[str, Any]], ranks: int) -> Study:
    """The study of points that were measured; rank 0 only.

    Args:
        plan: what was run.
        known: what was found, by the names of the points.
        ranks: that solved the points.
    """
    finest, *coarser = plan.reference
    levels = tuple(errors for point in coarser if (errors := known[point.name].get("errors")) is not None)
    certain = certainty(levels)
    rows = {point.name: _row(point, known[point.name], certain) for point in plan.points}
    return Study(
        title=plan.own.scene.title,
        rows=tuple(rows.values()),
        own=rows[plan.own.name],
        exact=rows[plan.exact_like(plan.own).name],
        certain=certain,
        reference=_row(finest, known[finest.name], certain),
        coarser=levels,
        left_out=plan.left_out,
        ranks=ranks,
    )


def _row(point: Point, known: Mapping[str, Any], certain: Mapping[str, Certainty]) -> Row:
    """A point's setting, and its record."""
    solver, errors = point.scene.solver, known.get("errors") or {}
    found = [(q, error, certain[q].error) for q, error in errors.items()]
    of_solver = ("smoothing", "epsilon", "epsilon_absolute", "method", "linear_solver", "tolerance")
    own = {name: getattr(solver, name) for name in of_solver}
    row = Row(point=point.name, mesh=point.mesh, degree=point.degree, h=None, **own)
    vars(row).update({key: value for key, value in known.items() if key != "limit"})
    row.h, row.epsilon = point.scene.domain.width() or known.get("h"), known["epsilon"] or solver.epsilon
    row.errors, row.epsilon_part = known.get("errors"), known.get("epsilon_part")
    row.beyond_reference = tuple(q for q, e, least in found if None not in (e, least) and e < least)
    return row


def _sentences(study: Study) -> Iterator[str]:
    """The most useful first."""
    quantities = study.headlines()
    yield _own(study, quantities[-1] if quantities else "energy_norm")
    yield from (_targets(study, quantity) for quantity in reversed(quantities))
    exact = {r.degree: r for r in study.rows if r.converged and r.smoothing is None}
    for degree, like in sorted(exact.items()):
        found = [(q, study.order(q, like)) for q in quantities]
        if parts := [f"h^{value:.2f} in {NORMS[q][1]}" for q, value in found if value is not None]:
            yield f"With the exact law the error at degree {degree} falls as {', '.join(parts)}, by two finest meshes."
    bad = [r for r in study.rows if not r.converged and r.exit_code != ExitCode.BAD_INPUT]
    if bad:
        yield f"{len(bad)} of {len(study.rows)} points ended without a certified solution; study.csv says why."
    known = [(q, study.certain[q].error) for q in quantities]
    parts = [f"{_of_error(e)} in {NORMS[q][1]}" for q, e in known if e is not None]
    sure = f"itself uncertain by {', '.join(parts)}" if parts else "on the only mesh there is"
    yield f"Measured against {study.reference.text} ({study.reference.dofs or 0:,} unknowns), {sure}."


def _own(study: Study, quantity: str) -> str:
    """What the scene's own setting costs, how far off it is, and by what."""
    own, setting = study.own, f"The scene's own setting ({study.own.text})"
    error, bare, share = own.error(quantity), study.exact.error(quantity), study.share_of_epsilon(quantity)
    if error is None:
        return f"{setting} was not measured: {own.reason}."
    text = f"{setting} takes {duration(own.seconds)} and is {_of_error(error)} off in {NORMS[quantity][1]}"
    if own.smoothing is None or bare is None:
        return f"{text}."
    text += "" if share is None else f", {percent(share)} of it by ε"
    return f"{text}. The exact law on the same mesh takes {duration(study.exact.seconds)} and is {_of_error(bare)} off."


def _targets(study: Study, quantity: str) -> str:
    """What each accuracy costs, up to the first that is not reached."""
    best, parts = study.front(quantity), dict[str, list[str]]()
    for target in _TARGETS:
        row = next((r for r in best if (study.claimed(r, quantity) or 0.0) <= target), best[-1])
        claimed, cost = study.claimed(row, quantity) or 0.0, f"for {duration(row.seconds)} ({row.text})"
        if claimed > target:
            parts[f"is not reached here; the best that can be claimed is {_of_error(claimed)} {cost}"] = [
                _of_error(target)
            ]
            break
        parts.setdefault(cost, []).append(_of_error(target))
    said = (f"{', '.join(targets)} {cost}" for cost, targets in parts.items())
    return f"In {NORMS[quantity][1]}: {'; '.join(said)}."


def _of_error(value: float) -> str:
    """A relative error as a percentage, to two digits."""
    return "below 0.001 %" if value < 1e-5 else percent(value)


def duration(value: float | None) -> str:
    """A time, to two digits."""
    if value is None:
        return "an unknown time"
    if value < 0.0995:  # which would be 1e+02 ms
        return f"{1e3 * value:.2g} ms"
    return f"{value:.2g} s" if value < 9.95 else f"{value:.0f} s"

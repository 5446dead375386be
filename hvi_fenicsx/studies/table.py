"""A study in numbers: one row for each point, the Pareto front of each quantity, ``study.csv`` and ``study.json``."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from ..errors import InputError
from ..scene import SolverTable
from ..schema import unknown
from .certainty import Certainty
from .cost import PHASES
from .error_norms import ERROR_NORMS, Errors
from .setting import ADAPTIVE, Setting, law_text
from .thresholds import DEFAULT, Thresholds


@dataclass(frozen=True, kw_only=True)
class Row:
    """A point: its setting, what it cost, how far off it is.

    Attributes:
        point: its name in the folder ``points``.
        mesh: as people name it.
        degree: of the elements.
        h: the mesh width, m; None of an adaptive mesh.
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
        peak_memory_mb: of the first run, summed over the ranks.
        seconds: median cost without compilation and output, see :mod:`.cost`.
        spread: standard error of the median, relative.
        runs: that the median is of.
        phases: median cost by phase, s.
        errors: relative, against the reference.
        epsilon_part: how far the point is from the exact law on its own mesh; None: it is exact, or that point failed.
        left_out: part of Γc near jumps of the law, which ``friction_max`` leaves out.
        beyond_reference: quantities whose error is below the reference's own.
    """

    point: str
    mesh: str
    degree: int
    h: float | None
    smoothing: str | None
    epsilon: float | None
    epsilon_absolute: float | None
    method: str
    linear_solver: str
    tolerance: float
    dofs: int | None
    converged: bool
    reason: str
    exit_code: int
    energy: float | None
    iterations: Mapping[str, int] | None
    peak_memory_mb: float | None
    seconds: float | None
    spread: float | None
    runs: int | None
    phases: Mapping[str, float] | None
    errors: Errors | None
    epsilon_part: Errors | None
    left_out: float | None
    beyond_reference: tuple[str, ...]

    @property
    def adaptive(self) -> bool:
        """Whether the mesh was refined to an accuracy."""
        return self.mesh.startswith(ADAPTIVE)

    @property
    def law(self) -> str:
        """The law in words: exact, or how it is smoothed."""
        return law_text(self.smoothing, self.epsilon, self.epsilon_absolute)

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
            quantity: one of ``ERROR_NORMS``.

        Raises:
            InputError: there is no such quantity.
        """
        if quantity not in ERROR_NORMS:
            raise InputError(unknown("quantity", quantity, ERROR_NORMS))
        return self.errors[quantity] if self.converged and self.errors else None


def row(
    point: str,
    setting: Setting,
    record: Mapping[str, Any],
    certain: Mapping[str, Certainty],
    *,
    errors: Errors | None = None,
    epsilon_part: Errors | None = None,
    left_out: float | None = None,
) -> Row:
    """The row of a finished point.

    Args:
        point: its name.
        setting: what it solved.
        record: what it cost and found.
        certain: how well the reference is known, by quantity.
        errors: relative, against the reference.
        epsilon_part: how far it is from the exact law on its own mesh.
        left_out: part of Γc that ``friction_max`` leaves out.
    """
    wanted, cost = setting.scene.solver, record.get("cost") or {}
    return Row(
        point=point,
        mesh=setting.mesh,
        degree=setting.degree,
        h=None if setting.accuracy is not None else setting.scene.domain.width() or record.get("h"),
        smoothing=wanted.smoothing,
        epsilon=record.get("epsilon", wanted.epsilon) if wanted.smoothing else None,
        epsilon_absolute=wanted.epsilon_absolute,
        method=wanted.method,
        linear_solver=wanted.linear_solver,
        tolerance=wanted.tolerance,
        **_picked(record, _RECORDED),
        **_picked(cost, ("seconds", "spread", "runs", "phases")),
        errors=errors,
        epsilon_part=epsilon_part,
        left_out=left_out,
        beyond_reference=_beyond(errors, certain),
    )


_RECORDED = ("dofs", "converged", "reason", "exit_code", "energy", "iterations", "peak_memory_mb")


def _picked(record: Mapping[str, Any], keys: Sequence[str]) -> dict[str, Any]:
    return {key: record.get(key) for key in keys}


def _beyond(errors: Errors | None, certain: Mapping[str, Certainty]) -> tuple[str, ...]:
    pairs = ((name, value, certain[name].error) for name, value in (errors or {}).items())
    return tuple(name for name, value, own in pairs if value is not None and own is not None and value < own)


def claimed_error(found: Row, quantity: str, certain: Mapping[str, Certainty]) -> float | None:
    """The error that can be claimed: not less than the reference's own.

    Args:
        found: the point.
        quantity: key of the error norm.
        certain: how well the reference is known, by quantity.
    """
    error = found.error(quantity)
    return None if error is None else max(error, certain[quantity].error or 0.0)


def front(
    rows: Sequence[Row], quantity: str, certain: Mapping[str, Certainty], thresholds: Thresholds = DEFAULT
) -> list[Row]:
    """The Pareto front: the points that nothing cheaper is as accurate as, cheapest first.

    Args:
        rows: all points.
        quantity: key of the error norm.
        certain: how well the reference is known, by quantity.
        thresholds: which gain in accuracy counts.
    """
    pairs = [(r.seconds, claimed_error(r, quantity, certain), r) for r in rows]
    known = sorted(((s, e, r) for s, e, r in pairs if s is not None and e is not None), key=lambda t: t[:2])
    found: list[Row] = []
    best = float("inf")
    for _, error, candidate in known:
        if error < thresholds.gain * best:
            best = error
            found.append(candidate)
    return found


def as_csv(rows: Sequence[Row]) -> str:
    """One line for each point; empty where there is nothing; errors in columns ``error_QUANTITY``."""
    text = io.StringIO()
    lines = [_flat(r) for r in rows]
    writer = csv.DictWriter(text, list(lines[0]) if lines else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows(lines)
    return text.getvalue()


def _flat(found: Row) -> dict[str, Any]:
    data = asdict(found)
    plain = {k: v for k, v in data.items() if not isinstance(v, dict | tuple) and k not in _NESTED}
    for name, keys in (("phases", PHASES), ("iterations", ("newton", "linear", "levels", "branch"))):
        plain |= {f"{name}_{key}": (data[name] or {}).get(key) for key in keys}
    for name, prefix in (("errors", "error"), ("epsilon_part", "epsilon_part")):
        plain |= {f"{prefix}_{key}": (data[name] or {}).get(key) for key in ERROR_NORMS}
    return {**plain, "beyond_reference": " ".join(found.beyond_reference)}


_NESTED = ("phases", "iterations", "errors", "epsilon_part", "beyond_reference")


def as_data(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """For ``study.json``."""
    return [asdict(r) for r in rows]

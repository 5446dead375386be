"""A study in numbers: one row for each point, the Pareto front of each quantity, ``study.csv`` and ``study.json``."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from . import meshes
from .cost import PHASES
from .errors import QUANTITIES, Errors
from .meshes import Setting
from .reference import Certainty


@dataclass(frozen=True)
class Row:
    """A point: its setting, what it cost, how far off it is.

    Attributes:
        point: its name in the folder ``points``. mesh, h: words, and the mesh width in m.
        smoothing, epsilon, epsilon_absolute: None for the exact law; ε relative, and in N/m where the scene says so.
        method, linear_solver, tolerance: of the solver table.
        dofs, converged, reason, exit_code, energy, iterations, peak_memory_mb: as in ``summary.json``; the memory is
            that of the first run, summed over the ranks.
        seconds, spread, runs, phases: cost without compilation and output, see :mod:`.cost`.
        errors: relative, by quantity, against the reference. epsilon_part: of these, how far the point is from the
            exact law on its own mesh (None: it is exact, or that point failed).
        left_out: share of Γc near jumps of the law, which ``friction_max`` leaves out.
        beyond_reference: quantities whose error is below the reference's own.
    """

    point: str
    mesh: str
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
        return self.mesh.startswith(meshes.ADAPTIVE)

    @property
    def law(self) -> str:
        """The law in words: exact, or how it is smoothed."""
        if self.smoothing is None:
            return "exact law"
        width = f"{self.epsilon_absolute:g} N/m" if self.epsilon_absolute is not None else f"{self.epsilon:.3g}"
        kind = "" if self.smoothing == "quadratic" else f"{self.smoothing}, "
        return f"{kind}ε = {width}"

    @property
    def words(self) -> str:
        """The setting in words; what is as the program chooses goes without saying."""
        parts = [self.mesh, self.law]
        parts += [self.method] if self.method != "auto" else []
        parts += [f"tolerance {self.tolerance:g}"] if self.tolerance != 1e-8 else []
        parts += [self.linear_solver] if self.linear_solver != "auto" else []
        return ", ".join(parts)

    def error(self, quantity: str) -> float | None:
        """Relative; None where there is none."""
        return self.errors[quantity] if self.converged and self.errors else None


def row(
    point: str,
    setting: Setting,
    record: Mapping[str, Any],
    errors: Errors | None,
    part: Errors | None,
    left_out: float | None,
    certain: Mapping[str, Certainty],
) -> Row:
    """The row of a finished point."""
    wanted, cost = setting.scene.solver, record.get("cost") or {}
    return Row(
        point=point,
        mesh=meshes.words(setting),
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
        epsilon_part=part,
        left_out=left_out,
        beyond_reference=_beyond(errors, certain),
    )


_RECORDED = ("dofs", "converged", "reason", "exit_code", "energy", "iterations", "peak_memory_mb")


def _picked(record: Mapping[str, Any], keys: Sequence[str]) -> dict[str, Any]:
    return {key: record.get(key) for key in keys}


def _beyond(errors: Errors | None, certain: Mapping[str, Certainty]) -> tuple[str, ...]:
    pairs = ((name, value, certain[name].error) for name, value in (errors or {}).items())
    return tuple(name for name, value, own in pairs if value is not None and own is not None and value < own)


GAIN = 0.95
"""So much smaller an error must be to be worth more time: below this, two solutions are the same."""


def told(found: Row, quantity: str, certain: Mapping[str, Certainty]) -> float | None:
    """The error that can be claimed: not less than the reference's own."""
    error = found.error(quantity)
    return None if error is None else max(error, certain[quantity].error or 0.0)


def front(rows: Sequence[Row], quantity: str, certain: Mapping[str, Certainty]) -> list[Row]:
    """The points that nothing cheaper is as accurate as, cheapest first (Pareto)."""
    pairs = [(r.seconds, told(r, quantity, certain), r) for r in rows]
    known = sorted(((s, e, r) for s, e, r in pairs if s is not None and e is not None), key=lambda t: t[:2])
    found: list[Row] = []
    best = float("inf")
    for _, error, candidate in known:
        if error < GAIN * best:
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
        plain |= {f"{prefix}_{key}": (data[name] or {}).get(key) for key in QUANTITIES}
    return {**plain, "beyond_reference": " ".join(found.beyond_reference)}


_NESTED = ("phases", "iterations", "errors", "epsilon_part", "beyond_reference")


def as_data(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """For ``study.json``."""
    return [asdict(r) for r in rows]

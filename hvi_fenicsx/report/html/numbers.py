"""The run in numbers: size and cost, and what happened on each part of Γc."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..contact_part import ContactPart
from ..reader import Result
from ..rounding import unless_noise
from ..units import number, quantity, thousands, unit_for

_PHASES = {
    "jit": "compiling forms (cached for the next run)",
    "mesh": "mesh",
    "assembly": "assembly",
    "existence": "whether a solution exists",
    "setup": "preparing the solver",
    "solve": "solving",
    "certificate": "certificate",
    "estimate": "error estimate",
    "output": "files and pictures",
}


def facts(result: Result) -> Iterator[tuple[str, str]]:
    """Size, method and what it took."""
    summary = result.summary
    ranks, energy = int(summary.get("ranks") or 1), summary.get("energy")
    yield "unknowns", thousands(int(summary.get("dofs") or 0))
    yield "processes (MPI ranks)", str(ranks)
    if summary.get("method"):
        yield "method", str(summary["method"])
    if (counts := summary.get("iterations")) is not None:
        names = ("branch", "newton", "linear", "levels")
        yield "steps", ", ".join(f"{counts[n]} {n}" for n in names if counts.get(n) is not None)
    if energy is not None:
        yield "energy", f"{number(energy, 8)} {'J' if result.body.dimension == 3 else 'J/m'}"
    if summary.get("peak_memory_mb"):
        yield "memory at its peak", f"{thousands(round(summary['peak_memory_mb']))} MB over all ranks"


def time(seconds: Mapping[str, float]) -> Iterator[dict[str, Any]]:
    """Seconds by phase, each with its share in percent; the total last."""
    total = float(seconds.get("total") or sum(seconds.values()) or 1.0)
    for name, value in seconds.items():
        if name != "total" and value is not None:
            yield {"name": _PHASES.get(name, name), "seconds": f"{value:.2f}", "share": round(100 * value / total, 1)}
    yield {"name": "in all", "seconds": f"{total:.2f}", "share": None}


def contact(part: ContactPart) -> dict[str, Any]:
    """What happened on a part of Γc."""
    rows: list[tuple[str, str]] = [("vertices", thousands(len(part["x"])))]
    if part.has("contact"):
        rows.append(("in contact", thousands(int(np.nansum(part["contact"])))))
        rows.append(("largest gap", _largest(part["gap"], "m")))
    rows += [("largest slip", _largest(np.abs(part.size("slip")), "m"))]
    if part.has("branch_t"):
        rows.append(("largest friction", _largest(np.abs(part.size("friction")), "Pa")))
        rows.append(("pieces of the friction law in use, from 0", _pieces(part["branch_t"])))
    rows += [("largest pressure", _largest(part.pressure, "Pa"))]
    if part.has("branch_n"):
        rows.append(("largest tension", _largest(part["sigma_n"], "Pa")))
        rows.append(("pieces of the normal law in use, from 0", _pieces(part["branch_n"])))
    return {"name": part.name, "rows": rows}


def forces(result: Result) -> dict[str, Any] | None:
    """The forces on the body by place and in all, by component; None where the summary has none."""
    found: Mapping[str, list[float]] = result.summary.get("resultants") or {}
    if not found:
        return None
    places = {**found, "in all": [sum(component) for component in zip(*found.values(), strict=True)]}
    dimension = len(places["in all"])
    largest = max(abs(v) for force in places.values() for v in force)
    unit = unit_for(largest, "N" if dimension == 3 else "N/m")
    rows = [
        {"name": name, "values": [unit.number(unless_noise(v, largest)) for v in force]}
        for name, force in places.items()
    ]
    return {"axes": [f"{axis}, {unit.name}" for axis in "xyz"[:dimension]], "rows": rows}


def _largest(values: Any, unit: str) -> str:
    known = values[np.isfinite(values)]
    return quantity(max(float(known.max()), 0.0), unit) if len(known) else "-"


def _pieces(branch: Any) -> str:
    """How many vertices are on which piece of the law's graph, counted from 0 as in ``contact.csv``."""
    found, counts = np.unique(branch[np.isfinite(branch)].astype(int), return_counts=True)
    return ", ".join(f"{thousands(int(n))} {_piece(int(piece))}" for piece, n in zip(found, counts, strict=True))


def _piece(index: int) -> str:
    return "on a kink" if index < 0 else f"on piece {index}"

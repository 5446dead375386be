"""The certificate and the estimate in plain language: what each number means, and whether it passed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ..reader import Result
from ..units import number

_ENTRIES = {
    "equilibrium": "Forces balance: the largest force that nothing carries, as a share of the load",
    "net_force": "Each body balances as a whole: the largest net force or moment that nothing carries, as a share of "
    "those that act",
    "penetration": "Nothing passes through an obstacle: the deepest intrusion, as a share of the largest displacement",
    "tension": "Contact only pushes: the largest pull in contact, as a share of the load's stress",
    "complementarity": "Contact presses only where it is closed: the largest overlap of an open gap with a pressure",
    "inclusion": "The law is obeyed: the largest distance of a traction from what its law allows there",
    "mixity": "The energies of separation are those of the mode: their largest change if they were taken anew",
}
"""All that must be within the tolerance."""
_OPTIONAL = "mixity"
"""The entry that is null where no law depends on the mode."""
_UNEXCUSED = ("net_force", "mixity")
"""The entries that must be so even where rounding relaxes the tolerance of the others."""
_SECOND_ORDER = {
    "local minimiser": "The solution is a local minimiser of the energy: a stable equilibrium.",
    "not a minimiser": "The solution is an equilibrium, but not a minimiser of the energy: it is unstable.",
    "undecided": "Whether the equilibrium is stable was left open; second_order = true in [solver] asks for it.",
}
_OTHERS = {
    "unique": "It is the only equilibrium.",
    "lowest": "No equilibrium has a lower energy.",
    "unknown": "Whether there are other equilibria is not known.",
}
_NO_HISTORY = (
    "A single run has no history: this is an equilibrium at this load, not of necessity that of loading, and "
    "a joint that is unloaded heals. `hvi path` follows the load."
)


def certificate(result: Result) -> dict[str, Any] | None:
    """Its rows and what goes with them; None where nothing was solved."""
    found = (result.last_borne or result.summary).get("certificate")
    if not found:
        return None
    tolerance = float(found["tolerance"])
    limit = max(tolerance, float(found.get("rounding") or 0.0))
    limits = dict.fromkeys(_ENTRIES, limit) | dict.fromkeys(_UNEXCUSED, tolerance)
    entries = {n: words for n, words in _ENTRIES.items() if n != _OPTIONAL or found.get(n) is not None}
    return {
        "passed": bool(found["passed"]),
        "demand": _demand(tolerance, limit),
        "rows": [_row(name, words, found[name], limits[name]) for name, words in entries.items()],
        "remarks": list(_remarks(result, found)),
    }


def _demand(tolerance: float, limit: float) -> str:
    """What the numbers must be, in a sentence: the tolerance, or what rounding makes of it."""
    if limit <= tolerance:
        return f"Each number must be at most {number(tolerance)}."
    return (
        f"Each number must be at most {_two_digits(limit)}: the tolerance {number(tolerance)} is below the rounding "
        f"errors at this displacement. The net force must be at most {number(tolerance)}."
    )


def _row(name: str, words: str, value: float | None, limit: float) -> dict[str, Any]:
    passed, text = (False, "not finite") if value is None else (value <= limit, _two_digits(value))
    return {"name": name, "words": words, "value": text, "passed": passed}


def _two_digits(value: float | None) -> str:
    return "not finite" if value is None else number(float(f"{value:.1e}"))


def _remarks(result: Result, found: Mapping[str, Any]) -> Iterator[str]:
    if (last := result.last_borne) is not None:
        yield (
            f"This is the certificate of the state shown, at load factor {last['factor']:.6g}, where stability ends. "
            "Under the whole load no equilibrium was found."
        )
    elif found["passed"]:
        yield _SECOND_ORDER.get(str(found["second_order"]), str(found["second_order"]))
    if pressed := result.summary.get("obstacle"):
        yield _pressed(pressed, result.summary["certificate"]["tolerance"])
    if others := result.summary.get("uniqueness"):
        yield f"{_OTHERS[others['state']]} {others['why'][0].upper()}{others['why'][1:]}."
    if any(role["laws"] for part in result.parts for role in result.roles(part.name)):
        yield _NO_HISTORY
    if result.summary.get("smoothing") and result.summary["epsilon"] is not None:  # null: there is no law
        yield _smoothed(result.summary, found)


def _pressed(obstacle: Mapping[str, Any], tolerance: float) -> str:
    """How far a force has moved the obstacle."""
    unit = "N/m" if len(obstacle["force"]) == 2 else "N"
    moved, force = (", ".join(number(float(f"{v:.6g}")) for v in obstacle[key]) for key in ("displacement", "force"))
    return (
        f"The obstacle of {obstacle['part']} is moved by ({moved}) m by the force ({force}) {unit}. Contact bears the "
        f"force but for {_two_digits(obstacle['difference'])} of it, which must be at most {number(tolerance)}."
    )


def _smoothed(summary: Mapping[str, Any], found: Mapping[str, Any]) -> str:
    width, away = _two_digits(summary["epsilon"]), _two_digits(found["inclusion_true"])
    return (
        f"The law was smoothed ({summary['smoothing']}, ε = {width} of the law's energy): the certificate is that of "
        f"the smoothed law. From the true one the tractions are off by up to {away} of its scale."
    )


_ESTIMATE = {
    "relative": "estimated error, as a share of the solution",
    "discretisation": "of it by the mesh",
    "smoothing": "of it by the smoothing of the law",
    "algebraic": "of it by the solver's tolerance",
}


def estimate(found: Mapping[str, float | None] | None) -> list[tuple[str, str]]:
    """The error estimate in the energy norm as rows of words and percentages; empty where there is none."""
    if not found:
        return []
    norm = float(found.get("energy_norm") or 0.0) or 1.0
    parts = {name: value if name == "relative" else value / norm for name, value in _known(found)}
    return [
        (words, f"{number(float(f'{100 * parts[name]:.2g}'))} %") for name, words in _ESTIMATE.items() if name in parts
    ]


def _known(found: Mapping[str, float | None]) -> Iterator[tuple[str, float]]:
    return ((name, value) for name, value in found.items() if value is not None)

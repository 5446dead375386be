"""The verdict on a scene before it is solved: its state, margins, load factors and modes, as data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from .motions import DEFAULT, Mode

ExistenceState = Literal["held", "metastable", "escapes", "borderline", "undecided"]
WORST_FIRST: tuple[ExistenceState, ...] = ("escapes", "undecided", "metastable", "borderline", "held")


@dataclass(frozen=True)
class PaperConditions:
    """The paper's conditions (A2s), nondimensional.

    Attributes:
        c: (Σ c4² area)^½ γ0, γ0 being the norm of the trace from Y into L² of the parts with c4 > 0.
        margin: min of -<g,y> over y in Y∩K∞ with |y| = 1, None if there is no such y.
        tie: differences of less than this are rounding.
    """

    c: float
    margin: float | None
    tie: float = 0.0

    @property
    def satisfied(self) -> bool:
        """(A2s)(i) or (iii): the paper's Theorem 1 asserts a solution."""
        return self.margin is None or (self.margin > 0.0 and self.margin > self.c + self.tie)


@dataclass(frozen=True)
class LoadFactors:
    """The factors of a load, the others constant, between which a body is held, and beyond which nothing bears it.

    For λ in (held_from, held) the state is `held`; for λ > peak or λ < peak_from it is `escapes`.

    Attributes:
        held_from: see above.
        held: see above; inf: no factor is too large; at most held_from: no factor is held.
        peak: see above.
        mode: the motion that limits the load at `held`, None where nothing does.
        peak_mode: the motion that limits the load at `peak`, likewise.
        peak_from: see above; above peak: no factor is borne.
    """

    held_from: float
    held: float
    peak: float
    mode: Mode | None
    peak_mode: Mode | None
    peak_from: float = -np.inf

    @property
    def never_held(self) -> bool:
        """Whether no factor is held."""
        if not np.isfinite(self.held):
            return self.held_from >= self.held
        return self.held - self.held_from <= DEFAULT.rounding * abs(self.held)

    def summary(self) -> dict[str, object]:
        """For JSON: null for infinite. Where no factor is held, or every factor escapes, a flag says so."""
        some = not self.never_held
        return {
            "never_held": not some,
            "always_escapes": self.peak == -np.inf,
            "held_from": _finite(self.held_from) if some else None,
            "held": _finite(self.held) if some else None,
            "peak": _finite(self.peak),
            "direction": self.mode.name if self.mode else None,
            "peak_direction": self.peak_mode.name if self.peak_mode else None,
        }


@dataclass(frozen=True, kw_only=True)
class Solvability:
    """What the rigid motions say about a scene; nondimensional, |y| is the largest rigid coefficient.

    Attributes:
        state: held, metastable, escapes or borderline; undecided where the programmes broke down.
        margin: min over y in C with |y| = 1 of ∫ j^∞(y_t) - <g,y>, None (infinite) if C = {0}.
        lambda_held: see LoadFactors.held, for the whole load; inf: nothing limits it, -inf: no factor is held.
        lambda_peak: see LoadFactors.peak.
        direction: the motion of escape (in the state borderline: the one in balance), None if held.
        critical: the motion that limits lambda_held.
        kernel: a basis of Y.
        loose: a basis of the motions that nothing holds.
        free: a basis of those of them on which the load does no work, both ways; in all states but `escapes` all do.
        paper: the paper's own conditions.
        held_from: see LoadFactors.held_from, where a law pushes the body; else -inf.
        trouble: in the state undecided, what broke down; margin and factors are then unknown (None, nan).
    """

    state: ExistenceState
    paper: PaperConditions
    margin: float | None = None
    lambda_held: float = np.inf
    lambda_peak: float = np.inf
    direction: Mode | None = None
    critical: Mode | None = None
    kernel: tuple[Mode, ...] = ()
    loose: tuple[Mode, ...] = ()
    free: tuple[Mode, ...] = ()
    held_from: float = -np.inf
    trouble: str = ""

    @property
    def never_held(self) -> bool:
        """Whether the body is held at no factor of the whole load."""
        return self.lambda_held == -np.inf

    def summary(self) -> dict[str, object]:
        """The `solvability` entry of summary.json: null for infinite or absent."""
        return {
            "state": self.state,
            "margin": self.margin,
            "held_from": _finite(self.held_from),
            "lambda_held": _finite(self.lambda_held),
            "never_held": self.never_held,
            "lambda_peak": _finite(self.lambda_peak),
            "direction": self.direction.name if self.direction else None,
            "kernel": [mode.name for mode in self.kernel],
            "free": [mode.name for mode in self.free],
            "paper": {"c": self.paper.c, "satisfied": self.paper.satisfied if self.state != "undecided" else None},
        }


def undecided(kernel: tuple[Mode, ...], c: float, trouble: str) -> Solvability:
    """No verdict. Solving may show more, since a certificate needs no verdict.

    Args:
        kernel: the motions that the conditions leave.
        c: the paper's constant.
        trouble: what broke down.
    """
    return Solvability(
        state="undecided",
        lambda_held=np.nan,
        lambda_peak=np.nan,
        kernel=kernel,
        paper=PaperConditions(c, np.nan),
        trouble=trouble,
    )


def held_up_to(held_from: float, held: float) -> float:
    """The factor up to which a body is held, -inf if it is held at none.

    Args:
        held_from: the factor from which on it is held.
        held: the factor up to which it is held.
    """
    return -np.inf if LoadFactors(held_from, held, np.inf, None, None).never_held else held


def combine(bodies: Sequence[Solvability]) -> Solvability:
    """The verdict on several bodies that do not touch each other: worst state, smallest margins. Local.

    The direction is that of the body in the worst state; the other bodies rest.
    """
    worst = min(bodies, key=lambda one: (WORST_FIRST.index(one.state), np.inf if one.margin is None else one.margin))
    kernel = tuple(mode for body in bodies for mode in body.kernel)
    c = float(np.linalg.norm([body.paper.c for body in bodies]))
    if worst.state == "undecided":
        return undecided(kernel, c, worst.trouble)
    known = [body for body in bodies if body.state != "undecided"]
    first, held_from = min(known, key=lambda body: body.lambda_held), max(body.held_from for body in known)
    return replace(
        worst,
        margin=_combined_margin([body.margin for body in known]),
        lambda_held=held_up_to(held_from, first.lambda_held),
        held_from=held_from,
        lambda_peak=min(body.lambda_peak for body in known),
        critical=first.critical,
        kernel=kernel,
        loose=tuple(mode for body in known for mode in body.loose),
        free=tuple(mode for body in known for mode in body.free),
        paper=PaperConditions(c, _combined_margin([body.paper.margin for body in known])),
    )


def combine_factors(bodies: Sequence[LoadFactors]) -> LoadFactors:
    """The factors of a load on several bodies: the scene is held where all of them are. Local."""
    last, peak = min(bodies, key=lambda one: one.held), min(bodies, key=lambda one: one.peak)
    start, first = max(one.held_from for one in bodies), max(one.peak_from for one in bodies)
    return LoadFactors(start, last.held, peak.peak, last.mode, peak.peak_mode, peak_from=first)


def _combined_margin(margins: Sequence[float | None]) -> float | None:
    """Minimum with |y| the largest of the norms: all bodies that escape move, else only the weakest."""
    known = [margin for margin in margins if margin is not None]
    lost = sum(margin for margin in known if margin < 0.0)
    if not known:
        return None
    return lost if lost < 0.0 else min(known)


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None

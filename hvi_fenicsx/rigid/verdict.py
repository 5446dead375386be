"""What is said about a scene before it is solved: its state, margins, load factors and modes, as data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from .motions import Mode

State = Literal["held", "metastable", "escapes", "borderline"]
WORST_FIRST: tuple[State, ...] = ("escapes", "metastable", "borderline", "held")


@dataclass(frozen=True)
class Paper:
    """The paper's conditions (A2s), nondimensional.

    c = (Σ c4² area)^½ γ0 with γ0 = 1; margin = min of -<g,y> over y in Y∩K∞ with |y| = 1, None if there is no
    such y.
    """

    c: float
    margin: float | None

    @property
    def obtuse(self) -> bool:
        """(A2s)(i) or (ii): the load makes an obtuse angle with every direction of escape."""
        return self.margin is None or self.margin > 0.0

    @property
    def satisfied(self) -> bool:
        """(A2s)(i) or (iii): the paper's Theorem 1 asserts a solution."""
        return self.margin is None or (self.margin > 0.0 and self.margin > self.c)


@dataclass(frozen=True)
class LoadFactors:
    """The factors of a load, the others constant, between which a body is held, and where the peak ends.

    For λ in (held_from, held) the state is `held`; for λ > peak it is `escapes`. held = inf: no factor is too
    large; held = -inf (held_from = inf) or held_from = held: none is held. `mode` and `peak_mode` are the
    motions that limit the load, None where nothing does.
    """

    held_from: float
    held: float
    peak: float
    mode: Mode | None
    peak_mode: Mode | None


@dataclass(frozen=True)
class Solvability:
    """What the rigid motions say about a scene; nondimensional, |y| is the largest rigid coefficient.

    Attributes:
        state: held, metastable, escapes or borderline.
        margin: min over y in C with |y| = 1 of ∫ j^∞(y_t) - <g,y>, None (infinite) if C = {0}.
        lambda_held: see LoadFactors.held, for the whole load; ±inf where there is no limit.
        lambda_peak: see LoadFactors.peak.
        direction: the motion of escape (in the state borderline: the one in balance), None if held.
        critical: the motion that limits lambda_held.
        kernel: a basis of Y.
        free: a basis of the motions that nothing holds and on which the load does no work, both ways.
        paper: the paper's own conditions.
        exact: False if a growth is not convex; margin and lambda_held are then upper bounds, and `held` is
            not claimed (`metastable` without a direction: only solving tells).
    """

    state: State
    margin: float | None
    lambda_held: float
    lambda_peak: float
    direction: Mode | None
    critical: Mode | None
    kernel: tuple[Mode, ...]
    free: tuple[Mode, ...]
    paper: Paper
    exact: bool = True

    def summary(self) -> dict[str, object]:
        """The `solvability` entry of summary.json: null for infinite or absent."""
        return {
            "state": self.state,
            "margin": self.margin,
            "lambda_held": self.lambda_held if np.isfinite(self.lambda_held) else None,
            "lambda_peak": self.lambda_peak if np.isfinite(self.lambda_peak) else None,
            "direction": self.direction.words if self.direction else None,
            "kernel": [mode.words for mode in self.kernel],
            "free": [mode.words for mode in self.free],
            "paper": {"c": self.paper.c, "satisfied": self.paper.satisfied},
        }


def unmovable(c: float) -> Solvability:
    """The verdict on a body whose conditions leave no rigid motion: coercive, held under any load."""
    return Solvability("held", None, np.inf, np.inf, None, None, (), (), Paper(c, None))


def combine(bodies: Sequence[Solvability]) -> Solvability:
    """The verdict on several bodies that do not touch each other: worst state, smallest margins. Local.

    The direction is that of the body in the worst state; the other bodies rest.
    """
    worst = min(bodies, key=lambda body: (WORST_FIRST.index(body.state), _number(body.margin)))
    first = min(bodies, key=lambda body: body.lambda_held)
    c = float(np.linalg.norm([body.paper.c for body in bodies]))
    return replace(
        worst,
        margin=_combined_margin([body.margin for body in bodies]),
        lambda_held=first.lambda_held,
        lambda_peak=min(body.lambda_peak for body in bodies),
        critical=first.critical,
        kernel=tuple(mode for body in bodies for mode in body.kernel),
        free=tuple(mode for body in bodies for mode in body.free),
        paper=Paper(c, _combined_margin([body.paper.margin for body in bodies])),
        exact=all(body.exact for body in bodies),
    )


def _combined_margin(margins: Sequence[float | None]) -> float | None:
    """Minimum with |y| the largest of the norms: all bodies that escape move, else only the weakest."""
    known = [margin for margin in margins if margin is not None]
    lost = sum(margin for margin in known if margin < 0.0)
    if not known:
        return None
    return lost if lost < 0.0 else min(known)


def _number(margin: float | None) -> float:
    return np.inf if margin is None else margin

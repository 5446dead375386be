"""An unknown passes from one segment of its graph to the next: what that is called, and what it does to stability."""

from __future__ import annotations

from dataclasses import dataclass

from .bonds import BondTable
from .segments import Kind, Segment, piece_at
from .state import Event
from .step import Step
from .tracer import Tracer


@dataclass(frozen=True, kw_only=True)
class Passing:
    """A passage.

    Attributes:
        unknown: which one passes.
        direction: along its graph, 1 or -1.
        before: the segment that it leaves.
        after: the one on which it goes on.
        folds: whether the factor turns; where it stands between rising and falling, at the end of that.
        neutral: whether the factor stands now or stood before, or other motions are held than before.
        unstable_change: by how many directions more the energy falls, unless neutral.
        bifurcation: whether there are other ways to go on.
    """

    unknown: int
    direction: int
    before: Segment
    after: Segment
    folds: bool
    neutral: bool
    unstable_change: int
    bifurcation: bool

    @property
    def at_bound(self) -> bool:
        """Whether a contact closes or opens."""
        return Kind.BOUND in (self.before.kind, self.after.kind)


def go_on(tracer: Tracer, bonds: BondTable, step: Step) -> Passing:
    """Let the unknown that reached the end of its segment go on.

    Args:
        tracer: the curve.
        bonds: the bonds, which remember.
        step: what the tracer reported.
    """
    assert step.variable is not None
    assert step.before is not None
    trend, stood, held, i = tracer.trend, tracer.stands, tracer.cells.held, step.variable
    forward = bool(tracer.rates[i] > 0.0)
    if step.reversed:
        _turn_back(tracer, bonds, i, forward=forward)
    else:
        tracer.enter(i, *tracer.cells.beyond(i, forward=forward))
    after, folds = tracer.cells.segment(i), tracer.trend * trend < 0
    return Passing(
        unknown=i,
        direction=1 if forward else -1,
        before=step.before,
        after=after,
        folds=folds,
        neutral=stood or tracer.stands or tracer.cells.held is not held,
        unstable_change=_change(step.before, after) if folds else 0,
        bifurcation=step.tied > 1 and folds,
    )


def _turn_back(tracer: Tracer, bonds: BondTable, i: int, *, forward: bool) -> None:
    """On to the secant of where the bonds have been."""
    cells = tracer.cells
    force = float(cells.bond_force[i])
    x = bonds.remember(i, float(cells.x[i]), force)
    chain = bonds.chain(i)
    number = piece_at(chain, x, bonds.thresholds.at_end, forward=forward)
    tracer.enter(i, number, chain[number].coordinate(x, force), chain)


def _change(before: Segment, after: Segment) -> int:
    """How the number of unstable directions changes where the factor turns."""
    if before.kind is Kind.PIECE and after.kind is Kind.PIECE:
        return 1 if after.slope < before.slope else -1
    if before.kind is Kind.PIECE:
        return 1 if _drops(after) else -1
    return -1 if _drops(before) else 1


def _drops(segment: Segment) -> bool:
    return segment.kind is Kind.JUMP and segment.rise < 0.0


def classify(passing: Passing) -> Event:
    """What an event is called."""
    if passing.folds:
        return Event.FOLD
    if passing.after.kind is Kind.BOUND:
        return Event.CONTACT
    return Event.RELEASE if passing.before.kind is Kind.BOUND else Event.KINK

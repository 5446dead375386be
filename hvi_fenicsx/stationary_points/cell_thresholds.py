"""The numbers that tune how cells of the search for all equilibria are decided."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class CellThresholds:
    """How cells are made smaller, decided and divided.

    Attributes:
        most_rounds: how often a cell is tightened before it is divided.
        shorter: tightening goes on while some interval shrinks to this share.
        most_looks: how often a cell is tested by the weighed balance before it is divided.
        shorter_look: it is tested again while some interval shrinks to this share.
        widened: relative widening of what intervals of forces leave, for rounding.
        least_widened: the least widening, where displacements are about 1: without it, an interval that is clipped
            again and again about a joint at zero would end there.
        settled: intervals shorter than this about a jump or at a bound are that place.
        force_passes: passes over all unknowns by their own balance.
        force_progress: a pass that makes no interval shorter by this share is the last.
        rigid_passes: passes over all unknowns by the balance of whole bodies.
        rigid_progress: a pass of these that makes no interval shorter by this share is the last.
        rigid: eigenvalues of S below this share of the largest are those of rigid motions.
        same_share: shares of a rigid motion that are this near to 0, 1 or -1 are these numbers.
        part: share of the largest curvature.
        widened_radius: relative widening of the radius, for rounding and for the residual of y.
        radius_passes: passes over what elastic parts differ by from those of a point.
        hull_rounding: corners nearer to the hull than this share of the products compared are kept.
        many_corners: where there are more corners than this, those inside the hull are left out.
        wide: intervals of pivots that are wider than this many times the largest joint are divided in growing parts,
        ratio: if their ends differ by this factor at least.
        off_end: a place between joints is at least this share of the interval from its ends.
        regular: least pivot, relative to the largest, of a matrix that counts as positive definite.
        condition: condition number beyond which a linear system is singular.
        roundings: rounding errors of forces, in machine epsilons for each unknown and each part of their sizes.
    """

    most_rounds: int = 6
    shorter: float = 0.9
    most_looks: int = 4
    shorter_look: float = 0.7
    widened: float = 1e-12
    least_widened: float = 1e-30
    settled: float = 1e-20
    force_passes: int = 8
    force_progress: float = 1e-3
    rigid_passes: int = 20
    rigid_progress: float = 0.1
    rigid: float = 1e-11
    same_share: float = 1e-9
    part: float = 0.9
    widened_radius: float = 1e-9
    radius_passes: int = 8
    hull_rounding: float = 1e-15
    many_corners: int = 8
    wide: float = 30.0
    ratio: float = 100.0
    off_end: float = 0.2
    regular: float = 1e-6
    condition: float = 1e12
    roundings: float = 8.0


@dataclass(frozen=True, kw_only=True)
class BalanceThresholds:
    """How the weights of a cell's balance are looked for.

    Attributes:
        part: share of the largest curvature.
        first: steps of the programme before its weights are tried,
        every: and between two trials.
        near: the proof is as good as it can be if it is this near to the programme's value.
        still: it is so, too, if it changes by less than this share, late.
        late: steps after which this counts.
        settled: residual at which the programme's value counts.
        roundings: rounding errors of a sum, in machine epsilons for each unknown and each part of its size.
        most_arcs: arcs of one law of which points are taken; of more, every second, or third, ...
        between: points between the ends of arcs on which h is convex.
        price: price of a force that is missing, relative to the largest displacement of the cell.
        noise: means off their graphs by a smaller share of the energies are on them: the method is no more exact.
        least_scale: least scale of a force, relative to the largest one.
        most_steps: steps of one programme.
        close: share of the way to the next zero of a share or a reduced cost.
        enough: mean product of shares and reduced costs that ends the steps.
        balanced: largest residual with that.
        regular: what is added to each block, relative to its trace.
        least: what is added besides.
        largest: changes that are larger are rounding.
    """

    part: float = 0.9
    first: int = 11
    every: int = 3
    near: float = 0.1
    still: float = 1e-3
    late: int = 12
    settled: float = 1e-4
    roundings: float = 4.0
    most_arcs: int = 12
    between: Sequence[float] = (0.25, 0.5, 0.75)
    price: float = 1e3
    noise: float = 1e-8
    least_scale: float = 1e-3
    most_steps: int = 36
    close: float = 0.995
    enough: float = 1e-12
    balanced: float = 1e-9
    regular: float = 1e-15
    least: float = 1e-12
    largest: float = 1e100

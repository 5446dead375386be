"""The numbers that tune the search for equilibria."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True, kw_only=True)
class PolylineThresholds:
    """How near polylines are to curved laws.

    Attributes:
        far: ends of the first box, relative to the problem's displacements; what is found must stay off them.
        bent: a share of the largest traction by which a traction bends or jumps where it has a joint.
        coarse: error of the energy of curved laws, relative to their scale, with which the first search is made.
        samples: intervals of an interval between two nodes on which the difference is bounded.
        most_nodes: nodes are not made denser beyond this number.
        one_place: places nearer than this share of their distance from zero are one.
    """

    far: float = 1e6
    bent: float = 0.01
    coarse: float = 1e-6
    samples: int = 64
    most_nodes: int = 2_000
    one_place: float = 1e-12


@dataclass(frozen=True, kw_only=True)
class ProgrammeThresholds:
    """How convex programmes are solved, and the energy is lowered.

    Attributes:
        most_steps: of each iteration: state changes before a proximal term is added, proximal steps, steps of Newton's
            method and of a descent; bounds hold for any point.
        reach: falls as large as the last one with which an energy is reached at most.
        slow: where laws act on lengths, a fall of the energy below this share of its parts is the last.
        close: share of the way to the bounds that a step of an interior point method may go.
    """

    most_steps: int = 40
    reach: float = 10.0
    slow: float = 1e-12
    close: float = 0.995


@dataclass(frozen=True, kw_only=True)
class PointThresholds:
    """What counts as a stationary point, and of which kind it is.

    Attributes:
        accuracy: forces in balance to this share of the largest one, and displacements on a joint to this share of the
            largest.
        zero: eigenvalues below this share of the largest are zero.
        same: points nearer than this share of the displacements are one.
        longest: way from the polylines' point, relative to its displacements, beyond which a point is another one.
    """

    accuracy: float = 1e-9
    zero: float = 1e-10
    same: float = 1e-7
    longest: float = 0.1


@dataclass(frozen=True, kw_only=True)
class SystematicThresholds:
    """How long points are looked for without a proof.

    Attributes:
        first_boxes: boxes that are tried for a proof before.
        reaches: how far known points push away in deflation.
        most_points: points from which further ones are looked for, one after the other.
        failures: attempts without a new point after which a start is given up.
        longest: how much longer or shorter a step becomes by deflation at most.
        same: where points are not exact, or were made so, those nearer than this share of the displacements are one.
    """

    first_boxes: int = 200
    reaches: Sequence[float] = (0.1, 1.0, 10.0)
    most_points: int = 100
    failures: int = 3
    longest: float = 10.0
    same: float = 1e-4


@dataclass(frozen=True, kw_only=True)
class BoundThresholds:
    """How the energy is bounded from below on a box, and the lowest searched.

    Attributes:
        part: share of the largest curvature that laws are given.
        least_weight: share of the weights of this that does not follow from where envelopes were not tight.
        tight: an envelope below its law by less than this share of the energy's parts is tight.
        slack: energy, relative to its parts, that is added to the level for what the relaxation's residual could hide.
        most_rounds: how often a box is bounded before it is divided.
        worthwhile: a round that closes less than this share of a box's gap is the last.
        lost: share of a box's gap that the chords of rigid motions may take off.
        share_used: share of the allowed gap that a search uses: so that rounding lifts no told gap above it.
        coarse_gap: gap of the first search where laws are curved, from which the error of their polylines is chosen.
        error_share: share of the gap that this error is aimed at.
    """

    part: float = 0.8
    least_weight: float = 0.1
    tight: float = 1e-14
    slack: float = 1e-6
    most_rounds: int = 6
    worthwhile: float = 0.15
    lost: float = 0.25
    share_used: float = 0.999
    coarse_gap: float = 1e-3
    error_share: float = 0.05


@dataclass(frozen=True, kw_only=True)
class CellThresholds:
    """How cells are made smaller, decided and divided.

    Attributes:
        most_rounds: how often a cell is made smaller before it is divided, and passes over all unknowns in each.
        shorter: this goes on while some interval shrinks to this share.
        widened: relative widening of what intervals of forces leave, for rounding.
        least_widened: the least widening, where displacements are about 1: without it, an interval that is clipped
            again and again about a joint at zero would end there.
        settled: intervals shorter than this about a jump or at a bound are that place.
        rigid: eigenvalues of S below this share of the largest are those of rigid motions.
        same_share: shares of a rigid motion that are this near to 0, 1 or -1 are these numbers.
        wide: intervals of pivots that are wider than this many times the largest joint are divided in growing parts.
        off_end: a place between joints is at least this share of the interval from its ends.
        regular: least pivot, relative to the largest, of a matrix that counts as positive definite.
        condition: condition number beyond which a linear system is singular.
        enough: a proof that gains less than this share by three more steps of its programme is as good as it can be.
        price: price of a force that is missing in the balance, relative to the largest displacement of the cell.
        roundings: rounding errors of forces, in machine epsilons for each unknown and each part of their sizes.
    """

    most_rounds: int = 6
    shorter: float = 0.7
    widened: float = 1e-12
    least_widened: float = 1e-30
    settled: float = 1e-20
    rigid: float = 1e-11
    same_share: float = 1e-9
    wide: float = 100.0
    off_end: float = 0.2
    regular: float = 1e-6
    condition: float = 1e12
    enough: float = 1e-3
    price: float = 1e3
    roundings: float = 8.0


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """How equilibria are searched.

    Attributes:
        polylines: of curved laws.
        programmes: of convex programmes.
        points: of stationary points.
        systematic: of the search without a proof.
        cells: of the search for all points.
        bounds: of the search for the lowest energy.
    """

    polylines: PolylineThresholds = field(default_factory=PolylineThresholds)
    programmes: ProgrammeThresholds = field(default_factory=ProgrammeThresholds)
    points: PointThresholds = field(default_factory=PointThresholds)
    systematic: SystematicThresholds = field(default_factory=SystematicThresholds)
    cells: CellThresholds = field(default_factory=CellThresholds)
    bounds: BoundThresholds = field(default_factory=BoundThresholds)


DEFAULT = Thresholds()

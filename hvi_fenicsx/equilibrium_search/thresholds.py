"""The numbers that tune the search for equilibria."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

PROGRAMMES = ((0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0), (2.0, 1.5, 1.0), (4.0, 2.0, 1.0), (-1.0, 0.0, 1.0))
"""See :attr:`SystematicThresholds.programmes`."""


@dataclass(frozen=True, kw_only=True)
class PolylineThresholds:
    """How near polylines are to curved laws.

    Attributes:
        far: ends of the first box, relative to the problem's displacements; what is found must stay off them.
        bent: a share of the largest traction by which a traction bends or jumps where it has a joint.
        coarse: error of the energy of curved laws, relative to their scale, with which the first search is made.
        samples: intervals of an interval between two nodes on which the difference is bounded.
        few_samples: the same where so few decide.
        most_nodes: nodes are not made denser beyond this number.
        one_place: places nearer than this share of their distance from zero are one.
        off_drops: how far a bound is moved off a drop, relative to the displacements.
    """

    far: float = 1e6
    bent: float = 0.01
    coarse: float = 1e-6
    samples: int = 512
    few_samples: int = 32
    most_nodes: int = 2_000
    one_place: float = 1e-12
    off_drops: float = 1e-11


@dataclass(frozen=True, kw_only=True)
class ProgrammeThresholds:
    """How convex programmes are solved.

    Attributes:
        most_steps: of each iteration: state changes before a proximal term is added, proximal steps, steps of Newton's
            method and of a descent; bounds hold for any point.
        step_shares: shares of such a step that are tried.
        short: a step whose displacements and forces are below this share of all changes the energy by its square: the
            last.
        settled: a decrease below this share of the parts of the energy is rounding.
        close: a length nearer than this share of the largest one to a joint is on it.
        beyond: where forces are held, vectors' unknowns without bounds end at this many times the largest displacement,
            and one unit.
    """

    most_steps: int = 40
    step_shares: Sequence[float] = tuple(0.5**k for k in range(16))
    short: float = 1e-8
    settled: float = 1e-15
    close: float = 1e-9
    beyond: float = 10.0


@dataclass(frozen=True, kw_only=True)
class PointThresholds:
    """What counts as a stationary point, and of which kind it is.

    Attributes:
        accuracy: forces in balance to this share of the largest one, and displacements on a joint to this share of the
            largest.
        zero: eigenvalues below this share of the largest are zero.
        same: points nearer than this share of the displacements are one.
        faster: Newton's method goes on in a balance that is good enough while each step leaves less than this share of
            the rest; at a fold, where two points are one, a step leaves a quarter, where three are one 0.3, and never
            more than 1/e.
        longest: way from the polylines' point, relative to its displacements, beyond which a point is another one.
        roundings: rounding errors of forces, in machine epsilons for each unknown and each part of their sizes.
    """

    accuracy: float = 1e-9
    zero: float = 1e-10
    same: float = 1e-7
    faster: float = 0.5
    longest: float = 0.1
    roundings: float = 64.0


@dataclass(frozen=True, kw_only=True)
class DescentThresholds:
    """How the energy is lowered.

    Attributes:
        reach: falls as large as the last one with which an energy is reached at most.
        slow: where laws act on lengths, a fall of the energy below this share of its parts is the last.
    """

    reach: float = 10.0
    slow: float = 1e-12


@dataclass(frozen=True, kw_only=True)
class SystematicThresholds:
    """From where, and how long, points are looked for without a proof.

    Attributes:
        programmes: load factors, one after the other; each programme begins at rest.
        multiples: of the state that loading leads to.
        most_shifts: by how many different numbers of pieces unknowns are moved.
        fronts: how many fronts are tried on each piece of the laws.
        reaches: how far known points push away in deflation.
        most_points: points from which further ones are looked for, one after the other.
        failures: attempts without a new point after which a start is given up.
        same: where points are not exact, or were made so, those nearer than this share of the displacements are one.
        most_vain: attempts in a row to find a new point, where a proof goes on after them.
        accuracy: residual of a root, relative to the largest force.
        longest: how much longer or shorter a step becomes by deflation at most.
        least_weight: weight of a displacement that meets no stiffness, over the largest; so a flat piece of its law has
            a length.
    """

    programmes: Sequence[Sequence[float]] = PROGRAMMES
    multiples: Sequence[float] = (0.0, 0.5, 2.0, 5.0, 20.0)
    most_shifts: int = 16
    fronts: int = 8
    reaches: Sequence[float] = (0.1, 1.0, 10.0)
    most_points: int = 100
    failures: int = 3
    same: float = 1e-4
    most_vain: int = 100
    accuracy: float = 1e-11
    longest: float = 10.0
    least_weight: float = 1e-12


@dataclass(frozen=True, kw_only=True)
class BoundThresholds:
    """How the energy is bounded from below on a box.

    Attributes:
        spared: share of the curvature along rigid motions that S - D does not need, which is not lent.
        most_motions: rigid motions of unknowns with laws along which curvature is lent; the parts of several multiply.
        most_parts: parts of the interval of a rigid motion's share that are worth the curvature along it.
        tight: an envelope below its law by less than this share of the energy's parts is tight.
        least_weight: share of the weights of D that does not follow from where envelopes were not tight.
        growth: behind the laws' joints, parts of the interval of a share end this many times farther away than they
            begin.
        middle: where the interval of a share is divided else, between its ends.
        most_forces: forces along rigid motions that are tried for a finite box, each a quarter of the one before.
        slack: energy, relative to its parts, that is added to the level for what the relaxation's residual could hide.
    """

    spared: float = 0.98
    most_motions: int = 1
    most_parts: int = 64
    tight: float = 1e-14
    least_weight: float = 0.1
    growth: float = 8.0
    middle: tuple[float, float] = (0.2, 0.8)
    most_forces: int = 24
    slack: float = 1e-6


@dataclass(frozen=True, kw_only=True)
class LowestThresholds:
    """How the lowest energy is searched.

    Attributes:
        parts: shares of the largest curvature, in turn: the first leaves convexity to tighten with, the last bounds
            best.
        worthwhile: a round that closes less than this share of a box's gap is the last.
        most_skipped: boxes from which no descent is made, between two from which one is.
        lost: share of a box's gap that the chords of rigid motions may take off.
        share_used: share of the allowed gap that a search uses: so that rounding lifts no told gap above it.
        one_point: energies that differ by less than this share of their parts are those of one point.
        most_boxes: boxes that are bounded for the gap where what was asked for is not proven.
        sides: how often the gap counts the difference of energies of laws and their polylines: on both sides, and some
            more.
        coarse_gap: gap of the first search where laws are curved, from which the error of their polylines is chosen.
        error_share: share of the gap that this error is aimed at,
        most_share: and that it may take, on each side.
        shorter: the next one is made while some side of the region shrinks to this share.
    """

    parts: Sequence[float] = (0.9, 0.999)
    worthwhile: float = 0.15
    most_skipped: int = 10
    lost: float = 0.25
    share_used: float = 0.999
    one_point: float = 1e-11
    most_boxes: int = 50
    sides: float = 2.1
    coarse_gap: float = 1e-3
    error_share: float = 0.05
    most_share: float = 0.4
    shorter: float = 0.5


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
        widened_radius: relative widening of the radius, for rounding and for the residual of y.
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
    widened_radius: float = 1e-9
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
        first: steps of the programme before its weights are tried,
        every: and between two trials.
        near: the proof is as good as it can be if it is this near to the programme's value.
        still: it is so, too, if it changes by less than this share, late.
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

    first: int = 11
    every: int = 3
    near: float = 0.1
    still: float = 1e-3
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


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """How equilibria are searched.

    Attributes:
        polylines: of curved laws.
        programmes: of convex programmes.
        points: of stationary points.
        descent: of ways down.
        systematic: of the search without a proof.
        cells: of the search for all points.
        balance: of its test by a weighed balance.
        bounds: of the energy on boxes.
        lowest: of the search for the lowest energy.
    """

    polylines: PolylineThresholds = field(default_factory=PolylineThresholds)
    programmes: ProgrammeThresholds = field(default_factory=ProgrammeThresholds)
    points: PointThresholds = field(default_factory=PointThresholds)
    descent: DescentThresholds = field(default_factory=DescentThresholds)
    systematic: SystematicThresholds = field(default_factory=SystematicThresholds)
    cells: CellThresholds = field(default_factory=CellThresholds)
    balance: BalanceThresholds = field(default_factory=BalanceThresholds)
    bounds: BoundThresholds = field(default_factory=BoundThresholds)
    lowest: LowestThresholds = field(default_factory=LowestThresholds)


DEFAULT = Thresholds()

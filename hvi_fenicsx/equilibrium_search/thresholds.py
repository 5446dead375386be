"""The numbers that tune the search for equilibria."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True, kw_only=True)
class SearchThresholds:
    """How equilibria are searched.

    Attributes:
        rounding: differences of this relative size are rounding.
        accuracy: forces in balance to this share of the largest one, and displacements on a joint to this share of the
            largest; points nearer than 100 times this are one.
        zero: eigenvalues below this share of the largest are zero.
        same: points nearer than this share of the displacements are one.
        far: ends of the first box, relative to the problem's displacements; what is found must stay off them.
        bent: a share of the largest traction by which a traction bends or jumps where it has a joint.
        coarse: error of the energy of curved laws, relative to their scale, where no other one is asked for.
        samples: intervals of an interval between two nodes of a curved law on which the difference is bounded.
        most_nodes: nodes of a curved law are not made denser beyond this number.
        longest: way from the polylines' point, relative to its displacements, beyond which a point is another one.
        most_steps: of each iteration; bounds hold for any point.
        most_rounds: how often a box is made smaller before it is divided.
        worthwhile: a round that closes less than this share of a box is the last; chords of rigid motions may take off
            this share of its gap.
        nearly: the share of a way to a bound, and of the allowed gap, that is used.
        part: share of the largest curvature that laws are given.
        enough: a proof that gains less than this share by three more steps is as good as it can be; also the gap of a
            first search where laws are curved; a force that is missing in a balance costs one over this.
        error_share: share of the gap that polylines of curved laws may differ by.
        wide: intervals of pivots that are wider than this many times the largest joint are divided in growing parts.
        regular: least pivot, relative to the largest, of a matrix that counts as positive definite.
        first_boxes: boxes after which a search for all points asks for a bound of the energy.
        few_boxes: boxes in which a run that has found no equilibrium looks for one,
        few_unknowns: and the unknowns of Γc up to which it does: some ten seconds.
    """

    rounding: float = 1e-12
    accuracy: float = 1e-9
    zero: float = 1e-10
    same: float = 1e-7
    far: float = 1e6
    bent: float = 0.01
    coarse: float = 1e-6
    samples: int = 64
    most_nodes: int = 2_000
    longest: float = 0.1
    most_steps: int = 40
    most_rounds: int = 6
    worthwhile: float = 0.2
    nearly: float = 0.999
    part: float = 0.8
    enough: float = 1e-3
    error_share: float = 0.05
    wide: float = 100.0
    regular: float = 1e-6
    first_boxes: int = 200
    few_boxes: int = 500
    few_unknowns: int = 16


LIMITS = SearchThresholds()

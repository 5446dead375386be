"""Where a box is divided: at the law, or the rigid motion, of which its relaxation takes off most."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import motions
from .arcs import on_interval
from .boxes import Box
from .relaxation import Relaxation


def halves(relaxation: Relaxation, box: Box) -> list[Box]:
    """Two boxes: where the envelope and the law differ most, at the joint in the chord that is nearest to x.

    Args:
        relaxation: of the problem.
        box: the box, with the gaps of its relaxation.
    """
    if box.motion_gaps.max(initial=0.0) > box.gaps.max():
        return _halves_of_motion(relaxation, box)
    i = int(np.argmax(box.gaps))
    at = float(relaxation.problem.arguments(box.x)[i])
    chain = relaxation.problem.chains[i]
    ends = (a.high for a in on_interval(chain, float(box.low[i]), float(box.high[i]))[:-1])
    inside = [e for e in ends if box.chord_low[i] < e < box.chord_high[i]]
    if inside:
        at = min(inside, key=lambda e: abs(e - at))
    left, right = box.high.copy(), box.low.copy()
    left[i] = right[i] = at
    return [replace(box, high=left), replace(box, low=right)]


def _halves_of_motion(relaxation: Relaxation, box: Box) -> list[Box]:
    """Two boxes: parts of the interval of a rigid motion's share."""
    j = int(np.argmax(box.motion_gaps))
    left, right = box.motion_high.copy(), box.motion_low.copy()
    here, joint = float(relaxation.shares(box.x)[j]), float(relaxation.joints[j])
    limits = relaxation.problem.thresholds.bounds
    left[j] = right[j] = motions.divided(float(right[j]), float(left[j]), joint, here, limits)
    return [replace(box, motion_high=left), replace(box, motion_low=right)]

"""Laws from a Python function of the traction, sampled into a graph: the shortest way to your own law."""

from __future__ import annotations

import itertools
from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import ClassVar

import numpy as np
from typing_extensions import override

from ..errors import InputError
from ..typing import Array, Integers
from .polyline import PolylineLaw
from .thresholds import DEFAULT, Thresholds
from .traction_graph import TractionGraph


class SampledLaw(PolylineLaw):
    """A law given by its traction at displacements x > 0 and the ends of its smooth pieces.

    The traction is interpolated linearly between `samples` + 1 points a piece, so it is off by at most
    max |traction''| (piece length / samples)² / 8; jumps, at ends only, are exact. What is solved and
    certified is this interpolated law. It is odd, or zero for x < 0 where `one_sided = True`, and constant
    after the last end.
    """

    samples: ClassVar[int] = 200
    one_sided: ClassVar[bool] = False

    @abstractmethod
    def traction(self, x: Array) -> Array:
        """Traction (m,) at displacements x (m,) > 0 inside the pieces."""

    @abstractmethod
    def ends(self) -> Sequence[float]:
        """Where pieces end, ascending, > 0: every jump, every break of slope, and the start of the tail."""

    @override
    def build(self) -> TractionGraph:
        return TractionGraph.from_points(sample_traction(self.traction, self.ends(), self.samples), self.one_sided)

    def piece(self, x: Array) -> Integers:
        """Number (m,) of ends between 0 and x."""
        slip = np.maximum(x, 0.0) if self.one_sided else np.abs(x)
        return np.asarray(np.searchsorted(np.asarray(self.ends(), dtype=float), slip, side="right"), dtype=np.int64)

    @property
    @override
    def _corners(self) -> Array:
        # Not the samples: how finely the law is sampled is no scale of it.
        return np.asarray(self.ends(), dtype=np.float64)


def sample_traction(
    traction: Callable[[Array], Array], ends: Sequence[float], samples: int = 200, thresholds: Thresholds = DEFAULT
) -> tuple[tuple[float, float], ...]:
    """Points (displacement, traction) of a graph law from a function.

    Args:
        traction: the traction (m,) at displacements (m,) > 0, smooth between 0 and the ends.
        ends: ascending, > 0.
        samples: intervals between two ends.
        thresholds: what is meant as a jump.

    Raises:
        InputError: ends or samples are of no use, or a traction is not finite.
    """
    stops = np.append(0.0, np.asarray(ends, dtype=float))
    if stops.size < 2 or not np.all(np.isfinite(stops)) or np.any(np.diff(stops) <= 0.0) or samples < 1:
        raise InputError(
            f"ends = {list(ends)!r}, samples = {samples!r}: give ascending finite ends > 0 and samples >= 1"
        )
    pieces = [_sample_piece(traction, a, b, samples, thresholds.inside) for a, b in itertools.pairwise(stops)]
    size = max(float(np.abs(t).max()) for _, t in pieces)
    points = [(0.0, float(pieces[0][1][0]) if abs(pieces[0][1][0]) > thresholds.jump * size else 0.0)]
    for (x, t), follower in zip(pieces, [*pieces[1:], None], strict=True):
        points += [(float(a), float(b)) for a, b in zip(x[1:], t[1:], strict=True)]
        if follower is not None and abs(follower[1][0] - t[-1]) > thresholds.jump * size:
            points.append((float(x[-1]), float(follower[1][0])))
    return tuple(points)


def _sample_piece(
    traction: Callable[[Array], Array], a: float, b: float, samples: int, offset: float
) -> tuple[Array, Array]:
    """Abscissae and tractions of a piece; at its ends those just inside, for the one-sided limits."""
    x: Array = np.linspace(a, b, samples + 1, dtype=np.float64)
    inside = x.copy()
    inside[0] = max(np.nextafter(a, b), a + offset * (b - a))
    inside[-1] = min(np.nextafter(b, a), b - offset * (b - a))
    values = np.asarray(traction(inside), dtype=np.float64)
    if values.shape != x.shape or not np.all(np.isfinite(values)):
        raise InputError(
            f"the traction function must return one finite value for each displacement; between {a!r} and "
            f"{b!r} it returned {values!r}"
        )
    return x, values

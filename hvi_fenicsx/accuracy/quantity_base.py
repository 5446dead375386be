"""What a target quantity is: what an accuracy may be asked of, and how its error is estimated.

A new quantity is a subclass of :class:`Observable` with a ``name``: known to ``--quantity`` as soon as its module is
loaded.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar, TypeAlias

import numpy as np
from dolfinx import fem
from scipy.optimize import brentq

from ..class_registry import enter
from ..errors import InputError
from ..typing import Array
from .adaptive import AdaptiveLevel, AdaptiveStep

ORDERS = (0.5, 2.0)
"""The orders of convergence in h that are believed of a quantity: P1 has no larger one."""
SAFETY = (1.25, 3.0)
"""Safety factors of its error, where the order was observed and where it is assumed to be 1 (Roache 1994)."""

_APART = math.sqrt(2)
"""Ratio of the sizes of two meshes from which a difference tells something: twice the unknowns in the plane."""


class Quantity(ABC):
    """A target quantity on the levels of one adaptive run: its error on the last one, and what of it is smoothing's.

    Class attributes:
        name: for ``--quantity`` and ``summary.json``.
        description: what it is, for messages: "the slip on Γc in L2".
        in_energy_norm: whether its error is the estimate's own, in the energy norm.
        estimated: whether there is an estimate of its error on one mesh, for most scenes at least.
        needs_existence: whether existence (with it the load factors) is analysed on every mesh, not on the first only.
        registry: the quantities by their names.
    """

    name: ClassVar[str]
    description: ClassVar[str]
    in_energy_norm: ClassVar[bool] = False
    estimated: ClassVar[bool] = False
    needs_existence: ClassVar[bool] = False
    registry: ClassVar[dict[str, type[Quantity]]] = {}

    def __init_subclass__(cls) -> None:
        if "name" in cls.__dict__:
            enter(Quantity.registry, cls, cls.name, "quantity")

    _last: AdaptiveLevel

    def add(self, level: AdaptiveLevel) -> None:
        """Take the next level. Collective.

        Raises:
            InputError: on all ranks alike: the scene has no such quantity.
        """
        self._last = level

    @abstractmethod
    def error(self) -> float:
        """The estimated relative error on the last level; infinite where none is known yet. Collective."""

    @property
    def known_from_one_mesh(self) -> bool:
        """Whether one mesh is enough to estimate the error."""
        return self.estimated

    def parts(self, step: AdaptiveStep) -> tuple[float, float, float]:
        """The mesh's, smoothing's and the solver's part of the last level's error, relative.

        The last is that of the energy norm, and 0 where the quantity's own is not known.
        """
        if not math.isfinite(step.error):
            return math.inf, step.smoothing, 0.0
        return math.sqrt(max(step.error**2 - step.smoothing**2, 0.0)), step.smoothing, 0.0

    def ahead(self) -> fem.Function | None:
        """The displacement on the last level's mesh that a finer one is expected to have; None: take u_h itself."""
        return None

    def smoothing(self) -> float:
        """What smoothing changes of the quantity on the last level, relative: by default, in energy. Collective."""
        found = self._last.solution.estimate
        return 0.0 if found is None else found.smoothing / (found.energy_norm or 1.0)


Value: TypeAlias = fem.Function | Array
"""A quantity, SI: numbers, or a P1 vector field that is zero off Γc."""


class Observable(Quantity):
    """A quantity that is read off each level's solution; its error follows from its change from mesh to mesh.

    Three meshes are extrapolated by Richardson with the observed order, times a safety factor (Roache 1994, the grid
    convergence index): 1.25 where an order could be observed, 3 where it is assumed to be 1.

    Class attributes:
        power: of the norm on Γc in which a field is measured: 1 for L1, 2 for L2.
    """

    power: ClassVar[int] = 2

    def __init__(self) -> None:
        self._values: list[tuple[float, Value]] = []  # behind the mean mesh size, up to a factor

    @abstractmethod
    def read(self, level: AdaptiveLevel) -> Value:
        """Its value on a level in SI: numbers (n,), or a P1 vector field that is zero off Γc. Collective."""

    def missing(self, level: AdaptiveLevel) -> str | None:
        """What the scene lacks to have this quantity, for a message; None where it lacks nothing. Collective."""
        return None

    def value(self, level: AdaptiveLevel) -> Value:
        """As :meth:`read`. Collective.

        Raises:
            InputError: on all ranks alike: the scene has no such quantity.
        """
        if lack := self.missing(level):
            raise InputError(f"--quantity {self.name}: {lack}")
        return self.read(level)

    def add(self, level: AdaptiveLevel) -> None:
        """See :meth:`Quantity.add`; fields of coarser levels are taken to the new mesh. Collective."""
        if level.solution.examination is None:
            self._values = []
            return
        self._values = [
            (size, value if isinstance(value, np.ndarray) else prolong(value, level, self._last))
            for size, value in self._values
        ]
        size = float(level.dofs) ** (-1.0 / level.solution.scene.dimension)
        self._values.append((size, self.value(level)))
        super().add(level)

    def error(self) -> float:
        """See :meth:`Quantity.error`; infinite before a second mesh."""
        return float(np.hypot(self._change(), self.smoothing()))

    def _change(self) -> float:
        """The error without smoothing's part. Collective."""
        chosen = self._values[-1:]
        for one in reversed(self._values):
            if one[0] >= _APART * chosen[-1][0]:
                chosen.append(one)
        sizes, values = zip(*chosen[:3], strict=True)
        own, *others = (value.x.array if isinstance(value, fem.Function) else value for value in values)
        if not others:
            return np.inf
        largest = self._norm(own) or 1.0
        return extrapolated(sizes, *(self._norm(own - other) / largest for other in others))

    def _norm(self, numbers: Array) -> float:
        """The norm of a quantity on the last level, or of a difference there."""
        if isinstance(self._values[-1][1], fem.Function):
            return contact_norm(self._last, numbers, self.power)
        return float(np.linalg.norm(numbers))


def extrapolated(sizes: Sequence[float], change: float, further: float | None = None) -> float:
    """The error of a quantity on the finest of three meshes, or of two.

    Args:
        sizes: of the meshes, the finest first.
        change: of the quantity from the second to the first.
        further: the change from the third to the first; None where there is no third.
    """
    if change == 0.0:
        return 0.0
    order = 1.0 if further is None else _order(sizes, further / change)
    return SAFETY[further is None] * change / ((sizes[1] / sizes[0]) ** order - 1.0)


def _order(sizes: Sequence[float], ratio: float) -> float:
    """The order p at which (h3^p - h1^p)/(h2^p - h1^p) has this value, within what P1 can have."""
    near, far = sizes[1] / sizes[0], sizes[2] / sizes[0]

    def excess(order: float) -> float:
        return float((far**order - 1.0) / (near**order - 1.0) - ratio)

    if excess(ORDERS[0]) > 0:
        return ORDERS[0]
    return ORDERS[1] if excess(ORDERS[1]) < 0 else float(brentq(excess, *ORDERS))


def contact_norm(level: AdaptiveLevel, values: Array, power: int) -> float:
    """The L1 or L2 norm of a vector field on Γc, by vertex quadrature. Collective.

    Args:
        level: where the field is.
        values: its local array.
        power: 1 or 2.
    """
    found = 0.0
    for state in level.states:
        lengths = np.linalg.norm(state.surface.values(values), axis=1)
        found += float(np.sum(state.surface.weights * lengths**power))
    return float(float(level.comm.allreduce(found)) ** (1.0 / power))


def prolong(field: fem.Function, level: AdaptiveLevel, coarser: AdaptiveLevel) -> fem.Function:
    """A vector field of the next coarser level on the mesh of a level. Collective.

    Args:
        field: P1, on ``coarser``.
        level: where to.
        coarser: the level before it.
    """
    return level.prepared.system.displacement(level.step * coarser.prepared.system.unknowns(field))

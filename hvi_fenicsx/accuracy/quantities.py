"""What an accuracy may be asked of, and its error: from the estimate's defect, or by its change from mesh to mesh.

The latter follows from three meshes by Richardson's extrapolation with the observed order, times a safety factor
(Roache 1994, the grid convergence index): 1.25 where an order could be observed, 3 where it is assumed to be 1.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from dolfinx import fem
from scipy.optimize import brentq

from ..certify.contact_state import State
from ..certify.estimate import estimator
from ..certify.force_attribution import NEAR
from ..effects import Direction
from ..errors import InputError
from ..runtime.mpi import total
from ..typing import Array
from .adaptive import Rung

Name = Literal["energy", "u_t", "sigma_t", "resultant", "lambda_held", "lambda_peak"]
NAMES: Mapping[str, str] = {
    "energy": "the displacement in the energy norm",
    "u_t": "the slip on Γc in L2",
    "sigma_t": "-σ_t on Γc in L1",
    "resultant": "the contact force",
    "lambda_held": "the residual strength",
    "lambda_peak": "the peak strength",
}
_APART = 1.4
"""Ratio of the mesh sizes of two rungs from which their difference tells something."""
_ORDERS = (0.5, 2.0)
_OBSERVED, _ASSUMED = 1.25, 3.0
_SAFETY = {"u_t": 1.7, "sigma_t": 1.5}
"""What the estimates on Γc are multiplied with: on coarse meshes they are down to 0.6 and 0.7 of the truth."""


@dataclass(frozen=True)
class Sample:
    """A quantity on one rung, nondimensional in no way (SI): a field on Γc, taken to the mesh at hand, or numbers.

    Attributes:
        size: mean mesh size, up to a factor. value: a P1 vector field, zero off Γc, or numbers.
    """

    size: float
    value: fem.Function | Array


class Watched(ABC):
    """A quantity on the rungs of a climb: its error on the last one, and what of it is smoothing's."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._last: Rung

    def add(self, rung: Rung) -> None:
        """Take the next rung. Collective.

        Raises:
            InputError: the scene has no such quantity.
        """
        self._last = rung

    @abstractmethod
    def error(self) -> float:
        """The estimated relative error on the last rung; infinite where none is known yet. Collective."""

    def ahead(self) -> fem.Function | None:
        """The displacement on the last rung's mesh that a finer one is expected to have; None where u_h has to do."""
        return None

    def smoothing(self) -> float:
        """What smoothing changes of the quantity on the last rung, relative. Collective.

        Of -σ_t the distance from the unsmoothed law at the same slip; of the others, what it changes in energy.
        """
        found = self._last.solution.estimate
        if self.name != "sigma_t":
            return 0.0 if found is None else found.smoothing / (found.energy_norm or 1.0)
        whole = on_contact(self._last, _friction(self._last).x.array, 1)
        return _from_true_law(self._last) * self._last.prepared.problem.scales.stress / (whole or 1.0)


def watched(name: str, rung: Rung) -> Watched:
    """A quantity, from its first rung on: by the estimate's defect where that tells it, else by its changes."""
    told = name in _SAFETY and not rung.prepared.problem.bulk.averages_dilatation
    return Estimated(name) if told else History(name)


class Estimated(Watched):
    """Slip or -σ_t, whose error follows from the defect on one mesh (:mod:`.contact_errors`)."""

    _ahead: fem.Function | None = None

    def add(self, rung: Rung) -> None:
        """See :meth:`Watched.add`."""
        super().add(rung)
        READERS[self.name](rung)

    def error(self) -> float:
        """See :meth:`Watched.error`; with its safety factor."""
        found, self._ahead = self._last.solution, None
        if found.solve_result is None or found.examination is None:
            return np.inf
        parts = estimator.on_contact(self._last.prepared.system, found.solve_result.u, found.examination)
        self._ahead = parts.moved
        return _SAFETY[self.name] * (parts.slip if self.name == "u_t" else parts.friction)

    def ahead(self) -> fem.Function | None:
        """See :meth:`Watched.ahead`; known once the error is."""
        return self._ahead

    def smoothing(self) -> float:
        """See :meth:`Watched.smoothing`; with the same factor."""
        return _SAFETY[self.name] * super().smoothing()


class History(Watched):
    """A quantity that is compared from mesh to mesh."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._samples: list[Sample] = []

    def add(self, rung: Rung) -> None:
        """See :meth:`Watched.add`; the fields of the rungs below are taken to the new mesh. Collective."""
        if rung.solution.examination is None:
            self._samples = []
            return
        self._samples = [Sample(s.size, _moved(s.value, rung, self._last)) for s in self._samples]
        size = float(rung.dofs) ** (-1.0 / rung.solution.scene.dimension)
        self._samples.append(Sample(size, READERS[self.name](rung)))
        super().add(rung)

    def error(self) -> float:
        """See :meth:`Watched.error`; infinite before a second mesh."""
        return float(np.hypot(self._change(), self.smoothing()))

    def _change(self) -> float:
        """Without smoothing's. Collective."""
        own, *others = reversed(self._samples)
        apart = [other for other in others if other.size >= _APART * own.size]
        if not apart:
            return np.inf
        near = apart[0]
        far = next((s for s in apart if s.size >= _APART * near.size), None)
        largest = self._norm(own, None) or 1.0
        change = self._norm(own, near) / largest
        further = None if far is None else self._norm(own, far) / largest
        return extrapolated((own.size, near.size, far.size if far else np.nan), change, further)

    def _norm(self, own: Sample, other: Sample | None) -> float:
        if isinstance(own.value, np.ndarray):
            return float(np.linalg.norm(own.value - (0.0 if other is None else other.value)))
        difference = own.value.x.array - (0.0 if other is None else other.value.x.array)  # type: ignore[union-attr]
        return on_contact(self._last, difference, 1 if self.name == "sigma_t" else 2)


def extrapolated(sizes: Sequence[float], change: float, further: float | None) -> float:
    """The error of a quantity on the finest of three meshes.

    Args:
        sizes: of the meshes, the finest first. change: of the quantity from the second to the first.
        further: from the third to the first; None where there is no third.
    """
    if change == 0.0:
        return 0.0
    order = 1.0 if further is None else _order(sizes, further / change)
    safety = _ASSUMED if further is None else _OBSERVED
    return safety * change / ((sizes[1] / sizes[0]) ** order - 1.0)


def _order(sizes: Sequence[float], ratio: float) -> float:
    """The order p at which (h3^p - h1^p)/(h2^p - h1^p) has this value, within what P1 can have."""
    near, far = sizes[1] / sizes[0], sizes[2] / sizes[0]

    def excess(order: float) -> float:
        return float((far**order - 1.0) / (near**order - 1.0) - ratio)

    low, high = _ORDERS
    if excess(low) > 0:
        return low
    return high if excess(high) < 0 else float(brentq(excess, low, high))


def on_contact(rung: Rung, values: Array, power: int) -> float:
    """The L1 or L2 norm on Γc (vertex quadrature) of a local array of vectors. Collective."""
    comm = rung.comm
    found = 0.0
    for state in _states(rung):
        lengths = np.linalg.norm(state.surface.values(values), axis=1)
        found += float(np.sum(state.surface.weights * lengths**power))
    return float(total(comm, found) ** (1.0 / power))


def _from_true_law(rung: Rung) -> float:
    """∫ of the distance of -σ_t from the unsmoothed law's graph over Γc, nondimensional. Collective."""
    found = 0.0
    for state in _states(rung):
        for term, argument, traction in zip(state.terms, state.arguments, state.tractions, strict=True):
            away = term.exact.distance(argument, traction, NEAR)
            found += float(np.sum(state.surface.weights * np.where(term.direction is Direction.SLIP, away, 0.0)))
    return total(rung.comm, found)


def _states(rung: Rung) -> tuple[State, ...]:
    examination = rung.solution.examination
    return () if examination is None else examination.states


def _moved(value: fem.Function | Array, rung: Rung, below: Rung) -> fem.Function | Array:
    return value if isinstance(value, np.ndarray) else carried(value, rung, below)


def carried(value: fem.Function, rung: Rung, below: Rung) -> fem.Function:
    """A vector field on the rung below, on the mesh of this one. Collective."""
    return rung.prepared.system.displacement(rung.step * below.prepared.system.unknowns(value))


def _field(rung: Rung, read: Callable[[State], Array], unit: float) -> fem.Function:
    """Tangential vectors (m, d-1) of each part as a field."""
    field = fem.Function(rung.prepared.problem.space)
    rows = field.x.array.reshape(-1, rung.solution.scene.dimension)
    for state in _states(rung):
        rows[state.surface.blocks] = np.einsum("mk,mkd->md", read(state), state.surface.tangents) * unit
    field.x.scatter_forward()
    return field


def _slip(rung: Rung) -> fem.Function:
    if not rung.prepared.problem.surfaces:
        raise InputError("--quantity u_t: the scene has no part with contact or a law")
    return _field(rung, lambda state: state.slip, rung.prepared.problem.scales.displacement)


def _friction(rung: Rung) -> fem.Function:
    if not any(effect.key == "friction" for _, _, effect in rung.solution.scene.effects()):
        raise InputError("--quantity sigma_t: the scene has no friction")
    return _field(rung, lambda state: state.friction, rung.prepared.problem.scales.stress)


def _resultant(rung: Rung) -> Array:
    if not any(effect.key == "contact" for _, _, effect in rung.solution.scene.effects()):
        raise InputError("--quantity resultant: the scene has no contact")
    states = [s for s in _states(rung) if s.bounds is not None]
    pushes = [s.surface.weights[:, None] * s.pressure[:, None] * s.surface.normals for s in states]
    own = sum((p.sum(axis=0) for p in pushes), np.zeros(rung.solution.scene.dimension))
    return np.asarray(rung.comm.allreduce(own) * rung.prepared.problem.scales.force)


def _factor(rung: Rung, name: str) -> Array:
    value = float(getattr(rung.solution.solvability, name))
    if not np.isfinite(value):
        raise InputError(f"--quantity {name}: no load factor ends what holds the body; hvi check tells the state")
    return np.array([value])


READERS: Mapping[str, Callable[[Rung], fem.Function | Array]] = {
    "u_t": _slip,
    "sigma_t": _friction,
    "resultant": _resultant,
    "lambda_held": lambda rung: _factor(rung, "lambda_held"),
    "lambda_peak": lambda rung: _factor(rung, "lambda_peak"),
}

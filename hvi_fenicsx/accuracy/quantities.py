"""The target quantities: the energy norm, slip and friction on Γc, the contact force, the load factors."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import numpy as np
from dolfinx import fem

from ..certify.contact_state import ContactState
from ..class_registry import hint
from ..errors import InputError
from ..estimate.estimator import estimate_contact_errors
from ..typing import Array
from .adaptive import AdaptiveLevel, AdaptiveStep
from .quantity_base import Observable, Quantity, contact_norm


class EnergyNorm(Quantity):
    """The displacement in the energy norm, by the estimate.

    Class attributes:
        safety: what the estimate is multiplied with: it may be a tenth or two too small (docs/accuracy.md).
    """

    name = "energy"
    description = "the displacement in the energy norm"
    in_energy_norm = True
    estimated = True
    safety: ClassVar[float] = 1.25

    def error(self) -> float:
        """See :meth:`.Quantity.error`; with its safety factor."""
        found = self._last.solution.estimate
        return np.inf if found is None else self.safety * found.relative

    def parts(self, step: AdaptiveStep) -> tuple[float, float, float]:
        """See :meth:`.Quantity.parts`; with the safety factor."""
        return self.safety * step.discretisation, self.safety * step.smoothing, self.safety * step.algebraic


class ContactField(Observable):
    """A field on Γc. One mesh is enough to estimate its error, from the defect.

    Where div u is averaged, the defect does not see the pressure; there it is compared from mesh to mesh.

    Class attributes:
        safety: what the estimate is multiplied with: on coarse meshes it may be too small.
        field: its name among the estimated errors on Γc.
    """

    estimated = True
    safety: ClassVar[float]
    field: ClassVar[str]
    _ahead: fem.Function | None = None

    @property
    def known_from_one_mesh(self) -> bool:
        """See :attr:`.Quantity.known_from_one_mesh`."""
        return not self._last.prepared.problem.bulk.averaged

    def add(self, level: AdaptiveLevel) -> None:
        """See :meth:`.Quantity.add`."""
        if level.prepared.problem.bulk.averaged:
            super().add(level)
        else:
            Quantity.add(self, level)
            self.value(level)

    def error(self) -> float:
        """See :meth:`.Quantity.error`; with its safety factor."""
        if not self.known_from_one_mesh:
            return super().error()
        last, found, self._ahead = self._last, self._last.solution, None
        if found.solve_result is None or found.examination is None:
            return np.inf
        u, known = found.solve_result.u, None if found.estimate is None else found.estimate.field
        errors = estimate_contact_errors(last.prepared.system, last.levels, u, found.examination, known=known)
        self._ahead = errors.corrected
        return self.safety * float(getattr(errors, self.field))

    def ahead(self) -> fem.Function | None:
        """See :meth:`.Quantity.ahead`; known once the error is."""
        return self._ahead

    def smoothing(self) -> float:
        """See :meth:`.Quantity.smoothing`; with the safety factor that the error has."""
        return (self.safety if self.known_from_one_mesh else 1.0) * self.smoothing_change()

    def smoothing_change(self) -> float:
        """What smoothing changes of it on the last level, relative. Collective."""
        return super().smoothing()


class Slip(ContactField):
    """The slip on Γc."""

    name = "u_t"
    description = "the slip on Γc in L2"
    safety = 1.7
    field = "slip"

    def missing(self, level: AdaptiveLevel) -> str | None:
        """A part with contact or a law."""
        return None if level.prepared.problem.surfaces else "the scene has no part with contact or a law"

    def read(self, level: AdaptiveLevel) -> fem.Function:
        """u_t, m."""
        return _tangential(level, lambda state: state.slip, level.prepared.problem.scales.displacement)


class FrictionTraction(ContactField):
    """-σ_t on Γc."""

    name = "sigma_t"
    description = "-σ_t on Γc in L1"
    power = 1
    safety = 1.5
    field = "friction"

    def missing(self, level: AdaptiveLevel) -> str | None:
        """A law of the slip."""
        slips = any(term.direction.tangential for term in level.prepared.problem.terms)
        return None if slips else "the scene has no friction"

    def read(self, level: AdaptiveLevel) -> fem.Function:
        """-σ_t, N/m²."""
        return _tangential(level, lambda state: state.friction, level.prepared.problem.scales.stress)

    def smoothing_change(self) -> float:
        """The distance from the unsmoothed law at the same slip, relative. Collective."""
        level = self._last
        whole, apart = contact_norm(level, self.read(level).x.array, self.power), 0.0
        for law in (law for state in level.states for law in state.laws if law.term.direction.tangential):
            apart += float(np.sum(law.term.weights * law.true_distance()))
        return float(level.comm.allreduce(apart)) * level.prepared.problem.scales.stress / (whole or 1.0)


class Resultant(Observable):
    """The resultant of the contact pressure on all parts with contact."""

    name = "resultant"
    description = "the contact force"

    def missing(self, level: AdaptiveLevel) -> str | None:
        """Contact."""
        return None if level.prepared.problem.bounds else "the scene has no contact"

    def read(self, level: AdaptiveLevel) -> Array:
        """Its components (d,), N/m in 2D, N in 3D."""
        states = [s for s in level.states if s.bounds is not None]
        own = sum((s.resultant for s in states), np.zeros(level.solution.scene.dimension))
        return level.comm.allreduce(own) * level.prepared.problem.scales.force


class LoadFactor(Observable):
    """A load factor at which what holds the body ends."""

    needs_existence = True

    def missing(self, level: AdaptiveLevel) -> str | None:
        """A load that can be raised until the body escapes."""
        if np.isfinite(self.read(level)[0]):
            return None
        return "no load factor holds the body, or none ends what does; hvi check reports the state"

    def read(self, level: AdaptiveLevel) -> Array:
        """The factor, (1,)."""
        return np.array([getattr(level.solution.solvability, self.name)])


class HeldFactor(LoadFactor):
    """The factor up to which the laws hold the body whatever happened before."""

    name = "lambda_held"
    description = "the residual strength"


class PeakFactor(LoadFactor):
    """The factor up to which unbroken laws hold the body."""

    name = "lambda_peak"
    description = "the peak strength"


def find(name: str) -> type[Quantity]:
    """The quantity of a name.

    Raises:
        InputError: there is none.
    """
    if name not in Quantity.registry:
        known = tuple(Quantity.registry)
        raise InputError(f"--quantity: unknown name {name!r}{hint(name, known)}; allowed: {', '.join(known)}")
    return Quantity.registry[name]


def _tangential(level: AdaptiveLevel, read: Callable[[ContactState], Array], unit: float) -> fem.Function:
    """Tangential vectors (m, d-1) of each part as a field."""
    field = fem.Function(level.prepared.problem.space)
    rows = field.x.array.reshape(-1, level.solution.scene.dimension)
    for state in level.states:
        rows[state.surface.blocks] = np.einsum("mk,mkd->md", read(state), state.surface.tangents) * unit
    field.x.scatter_forward()
    return field

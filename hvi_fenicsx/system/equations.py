"""The equations of a system: residual, tangent and energy for what takes the place of the laws, and their rounding."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from petsc4py import PETSc

from ..problem.law_term import LawTerm
from ..typing import Array
from .jacobian import Jacobian
from .law_model import LawModel


class Equations:
    """A u - b + W τ(u) = 0, and the energy that belongs to it. Creation is collective.

    Residuals are computed from the rows of A itself at the vertices of Γc, not from those that a step holds.

    Args:
        jacobian: the stiffness A.
        terms: the laws, in the unknowns' components.
        load: b, lifted; the owner frees it.
    """

    def __init__(self, jacobian: Jacobian, terms: Sequence[LawTerm], load: PETSc.Vec) -> None:
        self._jacobian, self._terms, self._load = jacobian, tuple(terms), load
        self._comm = load.comm.tompi4py()
        self._work = load.duplicate()

    def with_load(self, load: PETSc.Vec) -> Equations:
        """The equations with another load; all else is shared.

        Args:
            load: b.
        """
        found = copy.copy(self)
        found._load = load
        return found

    def residual(self, x: PETSc.Vec, out: PETSc.Vec, models: Sequence[LawModel]) -> None:
        """The residual A u - b + W τ(u). Collective.

        Args:
            x: the unknowns u.
            out: where it is written; must have ghosts.
            models: what takes the place of the laws, by term.
        """
        self._jacobian.elastic_product(x, out)
        out.axpy(-1.0, self._load)
        with out.localForm() as local:
            local.array_w[out.local_size :] = 0.0
        for term, model in zip(self._terms, models, strict=True):
            u = x.array_r
            term.add_force(out, u, model.derivative(term.argument(u)))
        out.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)

    def tangents(self, x: PETSc.Vec, models: Sequence[LawModel], foundation: float = 0.0) -> list[Array]:
        """The tangent stiffness K of the laws, (m, d, d) by term.

        Args:
            x: the unknowns u.
            models: what takes the place of the laws, by term.
            foundation: stiffness added in all directions that are not prescribed: laws without any hold no motion.
        """
        u = x.array_r
        arguments = [term.argument(u) for term in self._terms]
        return [
            term.rate(u, model.derivative(a), model.second(a))
            + foundation * term.free[:, :, None] * np.eye(term.free.shape[1])
            for term, model, a in zip(self._terms, models, arguments, strict=True)
        ]

    def energy(self, x: PETSc.Vec, models: Sequence[LawModel]) -> float:
        """The energy ½ a(u, u) - <g, u> + Σ w j(u), up to a constant of the prescribed displacements. Collective.

        Args:
            x: the unknowns u.
            models: what takes the place of the laws j, by term.
        """
        self._jacobian.elastic_product(x, self._work)
        u = x.array_r
        local = 0.0
        for term, model in zip(self._terms, models, strict=True):
            local += float(np.sum(term.energy_weights * model.value(term.argument(u))))
        return 0.5 * float(x.dot(self._work)) - float(self._load.dot(x)) + float(self._comm.allreduce(local))

    @cached_property
    def _stiffness_norm(self) -> float:
        """‖A + W K‖ in the maximum norm, with nothing held. Collective when first used."""
        self._jacobian.hold(np.empty(0, np.int32))
        return float(self._jacobian.matrix.norm(PETSc.NormType.INFINITY))

    def energy_rounding(self, x: PETSc.Vec) -> float:
        """By how much rounding may change the energy at u: a few ε_machine ‖A‖ ‖u‖². Collective."""
        return 4 * float(np.finfo(float).eps) * self._stiffness_norm * float(x.norm()) ** 2

    def rounding_sample(self, x: PETSc.Vec, out: PETSc.Vec) -> None:
        """A sample of the rounding error of a residual: A times ±ε_machine u, the signs at random. Collective.

        Args:
            x: the unknowns u.
            out: where it is written.
        """
        shuffled = x.duplicate()
        signs = np.random.default_rng(self._comm.rank).choice([-1.0, 1.0], x.local_size)
        shuffled.array[:] = x.array_r * signs * np.finfo(float).eps
        self._jacobian.elastic_product(shuffled, out)
        shuffled.destroy()

    def free(self) -> None:
        """Free the PETSc objects, which those with another load share. Collective."""
        self._work.destroy()

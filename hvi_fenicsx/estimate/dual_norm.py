"""Dual energy norms on u_h's space: sqrt(r·A⁻¹r), A the stiffness without what contact or sticking holds.

Two functionals are measured so: what smoothing changes of the law, and what the solver left over.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from ..certify import balance
from ..certify.certificate import Examination
from ..certify.contact_state import ContactState, nearest
from ..certify.force_attribution import components, on_bounds, on_kink
from ..certify.thresholds import DEFAULT as CERTIFICATE
from ..problem.law_term import LawTerm
from ..problem.problem import Problem
from ..runtime.cost import Timer
from ..runtime.mpi import agree, largest, total
from ..system.held_solver import HeldPreconditioner, LinearSettings
from ..system.multigrid import Levels
from ..system.system import System
from ..system.thresholds import DEFAULT as SYSTEM
from ..typing import Array, Entities, Integers
from .bubbles import DEFAULT

NEAR = CERTIFICATE.near


class DualNorm:
    """The inverse of the system's stiffness where u is held: by contact, by convex kinks, by supports.

    Laws add the rising part of their tangent, so that the body they hold has no free motion. Creation is collective.

    Attributes:
        system: whose stiffness it is.
        held: the owned scalar dofs at which u is held.
    """

    def __init__(self, system: System, levels: Levels, u: fem.Function) -> None:
        self.system, self._before = system, system.jacobian.rates
        self._x = system.unknowns(u)
        self.held = _held(system, self._x)
        at = self._x.array_r
        system.jacobian.set_rates([_rising(system.comm, term, at) for term in system.terms])
        self._inverse = HeldPreconditioner(system, levels, LinearSettings.choose(system, levels=bool(levels)), Timer())
        self._inverse.prepare(self.held)

    def solve(self, functional: Array, tolerance: float = DEFAULT.tolerance) -> tuple[fem.Function, float]:
        """The Riesz representative of a functional and its energy norm. Collective.

        Args:
            functional: at the owned blocks, Cartesian, (n, d).
            tolerance: of the relative residual.
        """
        system = self.system
        load, x = self._load(functional), system.load.duplicate()
        x.set(0.0)
        if load.norm() > 0:
            self._inverse.solve(load, x, tolerance)
        energy = float(load.dot(x))
        return system.displacement(x), float(np.sqrt(max(energy, 0.0))) if np.isfinite(energy) else np.inf

    def force(self, field: fem.Function) -> Array:
        """The elastic force a(field, ·) at the owned blocks as :meth:`solve` takes it, (n, d). Collective.

        Args:
            field: of u_h's space, nondimensional; zero where u is prescribed.
        """
        system = self.system
        x, out = system.unknowns(field), system.load.duplicate()
        system.jacobian.elastic_product(x, out)
        cartesian = out if system.rotation is None else system.rotation * out
        return np.array(cartesian.array_r).reshape(-1, system.problem.dimension)

    def keep_within_bounds(self, error: fem.Function) -> bool:
        """Put u + an error on the bounds that it leaves, in place; from then on it is held there. Collective.

        Args:
            error: a field of u_h's space, nondimensional.

        Returns:
            Whether it left any.
        """
        at, before, error_there = self._x.array_r, self.held, self.system.unknowns(error)
        for bounds in self.system.bounds:
            dofs, sign = bounds.component()
            along = sign * (at[dofs] + error_there.array_r[dofs])
            inside = np.clip(along, bounds.lower, bounds.upper)
            beyond = np.abs(along - inside) > NEAR
            error_there.array[dofs[beyond]] = (sign * inside - at[dofs])[beyond]
            self.held = np.union1d(self.held, dofs[beyond]).astype(np.int32)
        leaves = any(agree(self.system.comm, len(self.held) > len(before)))
        if leaves:
            error.x.array[:] = self.system.displacement(error_there).x.array
            self._inverse.prepare(self.held)
        return leaves

    def _load(self, functional: Array) -> PETSc.Vec:
        system = self.system
        load = system.turned(functional)
        load.array[self.held] = 0.0
        load.array[system.problem.fixed_here] = 0.0
        return load

    def destroy(self) -> None:
        """Free the preconditioner and put the tangent back that was there. Collective."""
        self._inverse.destroy()
        self.system.jacobian.set_rates(self._before)


def _held(system: System, x: PETSc.Vec) -> Entities:
    """Owned scalar dofs on a bound, or on a convex kink of a law."""
    u = x.array_r
    found: list[Integers] = [np.empty(0, np.int64)]
    for bounds in system.bounds:
        dofs, sign = bounds.component()
        found.append(dofs[np.logical_or(*on_bounds(bounds, sign * u[dofs], NEAR))])
    for term in system.terms:
        stuck = on_kink(term.law.convex, term.argument(u), term.reach(NEAR))[:, None] & term.counts(u, NEAR)
        found.extend(dofs[stuck[:, i]] for i, (dofs, _) in enumerate(components(term)))
    return np.setdiff1d(np.unique(np.concatenate(found)), system.problem.fixed).astype(np.int32)


def _rising(comm: MPI.Comm, term: LawTerm, u: Array) -> Array:
    """The rising part of a law's tangent; where it is flat everywhere, a foundation in its place. Collective."""
    argument = term.argument(u)
    convex = term.law.convex
    second = np.maximum(term.law.derivatives(argument)[1], 0.0)
    if largest(comm, float(np.max(second, initial=0.0))) == 0.0:
        second = np.full_like(second, SYSTEM.foundation)
        return term.rate(u, second * argument * term.stretch, second * term.stretch)
    secant = np.maximum((convex.left(argument) + convex.right(argument)) / 2, 0.0) if term.radial else second
    return term.rate(u, secant, second)


def algebraic(problem: Problem, examination: Examination) -> Array:
    """Nodal forces that nothing accounts for: off the carriers, beyond the laws, pulling or distant contact; (n, d).

    Args:
        problem: what was solved.
        examination: of its solution.
    """
    rest = balance.unbalanced(problem, examination.forces.reaction, examination.states)
    rest = rest - law_forces(problem, examination.states, exact=False)  # a law's force is minus its residual
    for state in examination.states:
        if state.bounds is not None:
            p = state.contact_pressure
            possible = (state.on_upper & (p <= 0)) | (state.on_lower & (p >= 0))
            force = np.where(possible, 0.0, state.surface.weights * p)
            rest[state.surface.blocks] += force[:, None] * state.surface.normals
    return rest


def penetration_energy(problem: Problem, states: Sequence[ContactState]) -> float:
    """Σ force times penetration over the nodes with bounds. Collective.

    Args:
        problem: what was solved.
        states: of the parts of Γc.
    """
    local = 0.0
    for state in states:
        if state.bounds is not None:
            beyond = np.maximum(state.bounds.beyond(state.normal), 0.0)
            local += float(np.sum(state.surface.weights * np.abs(state.contact_pressure) * beyond))
    return total(problem.comm, local)


def law_forces(problem: Problem, states: Sequence[ContactState], *, exact: bool) -> Array:
    """The laws' nodal forces minus the nearest ones that they allow, owned blocks (n, d).

    Args:
        problem: what was solved.
        states: of the parts of Γc.
        exact: whether the unsmoothed laws are asked, not those that were solved.
    """
    d = problem.dimension
    forces = np.zeros((problem.space.dofmap.index_map.size_local, d))
    for state in states:
        for law in state.laws:
            term = law.term
            asked = term.exact if exact else term.law
            components = law.components / term.stretch[:, None]
            away = law.given - nearest(asked, term.length, components, law.given, term.reach(NEAR))
            away[law.hidden] = 0.0
            vectors = np.einsum("mk,mkd->md", away * term.weights[:, None], term.directions)
            np.add.at(forces, state.surface.blocks, vectors)
    return forces

"""The state of Γc at a given displacement: gaps, slips, tractions, pieces of the laws; from (u, problem) alone.

Tractions are nodal residual forces over lumped areas (design.md). Where a component is prescribed, the residual holds
the support's reaction too, so there the law's own traction stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import fem
from dolfinx.fem.petsc import assemble_vector
from petsc4py import PETSc

from .effects.base import Direction
from .lawterm import LawTerm
from .problem import Bounds, Problem
from .surface import Surface
from .system import normal_dofs

Array = npt.NDArray[np.float64]
NEAR = 1e-10
"""Distance (of u0) from a kink or a bound that counts as being on it."""


@dataclass(frozen=True)
class Forces:
    """Internal forces minus loads, and the loads, by vertex (owned), nondimensional, shape (blocks, d).

    The first is the reaction of whatever holds the body: zero off supports, contact and laws.
    """

    reaction: Array
    load: Array


@dataclass(frozen=True)
class State:
    """The vertices of one part (m), nondimensional.

    Attributes:
        surface: the part. bounds: of its normal displacement, or None. terms: its laws.
        normal, slip: u·n (m,) and u·t (m, d-1). gap: to the lower bound of -u·n, (m,), inf where there is none.
        pressure: σ_n (m,). friction: -σ_t (m, d-1). contact: on a bound, (m,). held: u·n is prescribed, (m,).
        arguments, tractions, distances: of each law, by term: what it acts on, the traction it should give, and how far
            that is from Clarke's subdifferential; (m,) each.
    """

    surface: Surface
    bounds: Bounds | None
    terms: tuple[LawTerm, ...]
    normal: Array
    slip: Array
    gap: Array
    pressure: Array
    friction: Array
    contact: npt.NDArray[np.bool_]
    held: npt.NDArray[np.bool_]
    arguments: tuple[Array, ...]
    tractions: tuple[Array, ...]
    distances: tuple[Array, ...]

    def branch(self, *directions: Direction) -> npt.NDArray[np.int64] | None:
        """The active piece of the law in one of these directions, (m,); None where there is no such law."""
        for term, argument in zip(self.terms, self.arguments, strict=True):
            if term.direction in directions:
                return term.law.branch(argument, NEAR)
        return None


def forces(problem: Problem, u: fem.Function) -> Forces:
    """Reassembled from the forms, whatever a solver believes. Collective."""
    d = problem.scales.dimension
    internal = _vector(ufl.action(problem.bilinear, u)).reshape(-1, d)
    load = sum((_vector(form).reshape(-1, d) for form in problem.linear.values()), np.zeros_like(internal))
    return Forces(internal - load, load)


def _vector(form: object) -> Array:
    vector = assemble_vector(fem.form(form))
    vector.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
    values: Array = vector.array.copy()
    vector.destroy()
    return values


def states(problem: Problem, u: fem.Function, reaction: Array) -> tuple[State, ...]:
    """The state of each part with bounds or laws, in the problem's order. Local."""
    return tuple(_state(problem, surface, u.x.array, reaction) for surface in problem.surfaces)


def _state(problem: Problem, surface: Surface, u: Array, reaction: Array) -> State:
    bounds = next((b for b in problem.bounds if b.surface is surface), None)
    terms = tuple(t for t in problem.terms if t.surface is surface)
    traction = reaction[surface.blocks] / surface.weights[:, None]
    displacement = surface.values(u)
    normal = np.sum(displacement * surface.normals, axis=1)
    friction = -np.einsum("mkd,md->mk", surface.tangents, traction)
    arguments = tuple(t.argument(u) for t in terms)
    touching = _touching(bounds, normal)
    wanted = tuple(
        _beside_contact(t, _wanted(t, traction, u, a), a, bounds, normal) for t, a in zip(terms, arguments, strict=True)
    )
    for term, value in zip(terms, wanted, strict=True):
        if term.direction is Direction.SLIP:
            friction = _with_prescribed(term, friction, value)
    return State(
        surface,
        bounds,
        terms,
        normal,
        np.einsum("mkd,md->mk", surface.tangents, displacement),
        np.full(len(normal), np.inf) if bounds is None else bounds.upper - normal,
        np.sum(traction * surface.normals, axis=1),
        friction,
        touching,
        np.isin(normal_dofs(surface.blocks, surface.normals)[0], problem.fixed),
        arguments,
        wanted,
        tuple(t.law.distance(a, w, NEAR) for t, a, w in zip(terms, arguments, wanted, strict=True)),
    )


def _touching(bounds: Bounds | None, normal: Array) -> npt.NDArray[np.bool_]:
    if bounds is None:
        return np.zeros(len(normal), dtype=bool)
    return (normal >= bounds.upper - NEAR) | (normal <= bounds.lower + NEAR)


def prescribed(term: LawTerm) -> npt.NDArray[np.bool_]:
    """Whether a component that the law acts along is prescribed."""
    along = np.any(np.abs(term.directions) > NEAR, axis=1)
    return np.any(along & (term.free == 0), axis=1)


def _wanted(term: LawTerm, traction: Array, u: Array, argument: Array) -> Array:
    """The traction that the law must give to balance the residual, along the law's argument; (m,)."""
    pulled = -np.einsum("mkd,md->mk", term.directions, traction)
    if pulled.shape[1] == 1:
        value = pulled[:, 0]
    else:
        slip = term.slip(u)
        along = np.sum(pulled * slip, axis=1) / np.where(argument > NEAR, argument, 1.0)
        value = np.where(argument > NEAR, along, np.linalg.norm(pulled, axis=1))
    low, high = term.law.interval(argument)
    return np.where(prescribed(term), (low + high) / 2, value)


def _beside_contact(term: LawTerm, value: Array, argument: Array, bounds: Bounds | None, normal: Array) -> Array:
    """Of a normal law on a closed vertex, what contact cannot carry: it only pushes, the law gives the rest."""
    if bounds is None or term.direction is Direction.SLIP:
        return value
    low, high = term.law.interval(argument, NEAR)
    outward = (normal >= bounds.upper - NEAR) == (term.direction is Direction.OPENING)
    onto = np.where(outward, np.maximum(value, low), np.minimum(value, high))
    return np.where(_touching(bounds, normal), onto, value)


def _with_prescribed(term: LawTerm, friction: Array, value: Array) -> Array:
    held = prescribed(term)
    if friction.shape[1] > 1 or not np.any(held):
        return friction
    return np.where(held[:, None], value[:, None], friction)


def balanced(problem: Problem, reaction: Array, parts: Sequence[State]) -> Array:
    """The reaction less what supports, contact and laws may carry: zero in equilibrium; shape (blocks, d)."""
    rest = reaction.copy()
    rest.reshape(-1)[problem.fixed[problem.fixed < rest.size]] = 0.0
    for state in parts:
        carried = [t.directions for t in state.terms]
        if state.bounds is not None:
            carried.append(state.surface.normals[:, None, :])
        for directions in carried:
            here = rest[state.surface.blocks]
            along = np.einsum("mkd,md->mk", directions, here)
            rest[state.surface.blocks] = here - np.einsum("mk,mkd->md", along, directions)
    return rest

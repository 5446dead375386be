"""The laws between the nodes: what they give pointwise along Γc, tested with bubbles and with the functions of u_h.

The discrete problem knows a law at the nodes only (trapezoidal rule, Simpson's). Between them the nodal tractions are
interpolated to τ_h, and the law wants τ ∈ ∂j(u_t): here the nearest such τ to τ_h.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from dolfinx import fem

from ..certify.contact_state import ContactState, LawState, nearest
from ..certify.placed_forces import traction
from ..certify.thresholds import DEFAULT as CERTIFICATE
from ..laws import Superpotential
from ..mesh import nodes
from ..problem.contact_surface import Surface
from ..problem.problem import Problem
from ..typing import Array, Mask
from . import bubbles
from .bubbles import DEFAULT, LocalForces, collected
from .traces import FacetPoints, Trace, interface_points, part_points


def stopped(law: Superpotential, before: Array, after: Array) -> Array:
    """Slips after a change, stopped at the convex kinks that they would pass; (..., k).

    A convex kink holds the slip by as much traction as its jump gives. To the explicit answer of a law a slip that
    changes its sign would give that jump in full, and the answer would not settle.

    Args:
        law: its superpotential j.
        before: the slips before the change; with k = 1 signed.
        after: the slips after the change.
    """
    if after.shape[-1] > 1:
        turned = np.sum(before * after, axis=-1, keepdims=True) < 0
        return np.where(turned, 0.0, after) if len(law.convex.kinks) else after
    for kink in law.convex.kinks:
        after = np.where((before - kink) * (after - kink) < 0, kink, after)
    return after


@dataclass(frozen=True)
class ErrorField:
    """An estimated error of u_h.

    Attributes:
        nodes: its part in the space of u_h.
        bubbles: what it adds between the nodes.
    """

    nodes: fem.Function
    bubbles: fem.Function


@dataclass(frozen=True, kw_only=True)
class SolvedLaw:
    """What u_h gives one law between the nodes, (f, q, k) each; no error changes it. Slips are over the law's stretch.

    Attributes:
        points: the quadrature points.
        multiplier: of the law, (f, q, 1).
        stretch: of the law, (f, q, 1).
        nodal: the interpolated nodal tractions.
        sticks: whether all nodes around are on a convex kink, (f, q, 1).
        nodewise: the slip, linear from node to node.
        slip: of u_h.
    """

    points: Trace
    multiplier: Array
    stretch: Array
    nodal: Array
    sticks: Mask
    nodewise: Array
    slip: Array


class LawTraces:
    """The laws between the nodes at a displacement. Creation is collective.

    Attributes:
        problem: what was solved.
        u: its solution u_h, nondimensional, ghosts updated.
        states: of the parts of Γc at u_h.
        exact: whether an error meets the unsmoothed laws, so that it has what smoothing changes, too.
        degree: of the solution.
        bubbles: the space of bubbles.
    """

    def __init__(
        self,
        problem: Problem,
        u: fem.Function,
        states: Sequence[ContactState],
        *,
        exact: bool,
    ) -> None:
        self.problem, self.u, self.states, self.exact = problem, u, states, exact
        self.degree = nodes.degree(problem.space)
        self.bubbles = bubbles.space(problem.space.mesh, self.degree)
        self._known: dict[str, FacetPoints] = {}
        self._traces: dict[int, Trace] = {}
        self._solved: dict[int, SolvedLaw] = {}

    def part(self, surface: Surface, directions: Array) -> Trace:
        """The quadrature points of a part, or of an interface. Collective.

        Args:
            surface: the part.
            directions: along which displacements are looked at, those of a law or the surface's tangents, (m, k, d).
        """
        key = id(directions)
        if key not in self._traces:
            self._traces[key] = Trace(self.problem, self._points(surface), surface, directions)
        return self._traces[key]

    def _points(self, surface: Surface) -> FacetPoints:
        degree = DEFAULT.facet_degree[self.degree - 1]
        if surface.part not in self._known:
            interface = self.problem.interface_of(surface)
            self._known[surface.part] = (
                part_points(self.problem, self.bubbles, surface, degree)
                if interface is None
                else interface_points(self.problem, self.bubbles, interface, degree // 2)
            )
        return self._known[surface.part]

    def of_law(self, state: ContactState, law: LawState, error: ErrorField | None = None) -> Array:
        """The tractions of a law between the nodes: those that it allows nearest to the nodes', (f, q, k). Collective.

        Args:
            state: of its part.
            law: one of the part's.
            error: added to u_h before the law is evaluated; nothing is added where a whole part of a facet sticks (its
                nodes on a convex kink), and elsewhere no slip passes a convex kink.
        """
        solved, (asked, slip) = self.of_u(state, law), self._asked(state, law, error)
        k, of_law, length = slip.shape[2], solved.nodal / solved.multiplier, law.term.length
        near = np.ravel(CERTIFICATE.near / solved.stretch)
        traction = nearest(asked, length, slip.reshape(-1, k), of_law.reshape(-1, k), near)
        return solved.multiplier * traction.reshape(slip.shape)

    def _asked(self, state: ContactState, law: LawState, error: ErrorField | None) -> tuple[Superpotential, Array]:
        """The law that an error meets, and the slip that it is asked at, over its stretch, (f, q, k). Collective.

        Where the nodes around do not pass a convex kink the slip does not dip beyond that.
        """
        solved = self.of_u(state, law)
        asked = law.term.exact if self.exact and error is not None else law.term.law
        slip = np.where(solved.sticks, solved.nodewise, stopped(asked, solved.nodewise, solved.slip))
        if error is not None:
            added = (solved.points.of_field(error.nodes) + solved.points.of_bubbles(error.bubbles)) / solved.stretch
            slip = stopped(asked, slip, slip + np.where(solved.sticks, 0.0, added))
        return asked, slip

    def rising(self, state: ContactState, law: LawState, error: ErrorField) -> tuple[Trace, Array]:
        """By how much the tractions of one law rise with the displacement, (f, q, k); none where it falls. Collective.

        Args:
            state: of its part.
            law: one of the part's.
            error: as in :meth:`of_law`.

        Returns:
            The quadrature points, and the rates along each direction.
        """
        solved, (asked, slip) = self.of_u(state, law), self._asked(state, law, error)
        flat, length = slip.reshape(-1, slip.shape[2]), law.term.length
        argument = flat[:, 0] if length is None else length.of(flat)
        second = np.maximum(asked.derivatives(argument)[1], 0.0)
        rates = second[:, None]
        if length is not None:  # alike along and across the displacement
            rates = np.einsum("mkk->mk", length.hessian(flat, second * argument, second))
        moves = solved.multiplier / solved.stretch * ~solved.sticks
        return solved.points, moves * rates.reshape(slip.shape)

    def of_u(self, state: ContactState, law: LawState) -> SolvedLaw:
        """What u_h gives a law. Collective.

        Args:
            state: of its part.
            law: one of the part's.
        """
        if id(law) not in self._solved:
            points = self.part(state.surface, law.term.directions)
            on_kink = points.interpolated(law.on_convex_kink()[:, None].astype(float), "hats")
            stretch = points.interpolated(law.term.stretch[:, None], "hats")
            self._solved[id(law)] = SolvedLaw(
                points=points,
                multiplier=points.interpolated(law.term.multiplier[:, None]),
                stretch=stretch,
                nodal=points.interpolated(law.carried, along=True),
                sticks=on_kink > 1 - CERTIFICATE.near,
                nodewise=points.of_field(self.u, "hats") / stretch,
                slip=points.of_field(self.u) / stretch,
            )
        return self._solved[id(law)]

    def tested(self, error: ErrorField | None = None) -> tuple[Array, Array]:
        """∫ τ·v ds of all laws tested with bubbles; the nodal forces minus that with u_h's; owned blocks. Collective.

        ``error`` is added to u_h as in :meth:`of_law`. The bubbles of two bodies that meet feel what contact or glue
        carries, too.
        """
        at_nodes, between = list[LocalForces](), list(self._carried_between_bodies)
        for state in self.states:
            for law in state.laws:
                points, traction = self.of_u(state, law).points, self.of_law(state, law, error)
                between += points.with_bubbles(traction)
                blocks, forces = points.with_nodes(traction)
                nodal = np.einsum("mk,mkd->md", law.given * law.term.weights[:, None], law.term.directions)
                at_nodes += [(blocks, -forces), (blocks, nodal)]
        return collected(self.bubbles, between), collected(self.problem.space, at_nodes)

    @functools.cached_property
    def _carried_between_bodies(self) -> list[LocalForces]:
        """As :meth:`_carried`, of all interfaces. Collective when first used."""
        between = [state for state in self.states if self.problem.interface_of(state.surface) is not None]
        return [forces for state in between for forces in self._carried(state)]

    def _carried(self, state: ContactState) -> list[LocalForces]:
        """∫ τ·v ds of what bodies that meet put on each other without a law, tested with bubbles. Collective."""
        force = -traction(state)
        for law in state.laws:
            force -= np.einsum("mk,mkd->md", law.carried, law.term.directions)
        axes = np.tile(np.eye(force.shape[1]), (len(force), 1, 1))
        if (interface := self.problem.interface_of(state.surface)) is not None and interface.first.curved:
            axes = np.concatenate([state.surface.normals[:, None], state.surface.tangents], axis=1)
        points = Trace(self.problem, self._points(state.surface), state.surface, axes)
        return points.with_bubbles(points.interpolated(np.einsum("mkd,md->mk", axes, force), along=True))


class LawSprings:
    """The springs of all laws at a displacement. Creation is collective.

    Args:
        traces: the laws between the nodes.
        error: added to u_h.
    """

    def __init__(self, traces: LawTraces, error: ErrorField) -> None:
        self._space = traces.bubbles
        self._rates = [traces.rising(state, law, error) for state in traces.states for law in state.laws]

    def diagonal(self) -> Array:
        """Forces for a unit of each bubble, at the owned blocks, (n, d). Collective."""
        return collected(self._space, [one for points, rates in self._rates for one in points.squared(rates)])

    def times(self, e: fem.Function) -> Array:
        """Forces of bubbles, at the owned blocks, (n, d). Collective.

        Args:
            e: the bubbles, ghosts updated.
        """
        forces = [points.with_bubbles(rates * points.of_bubbles(e)) for points, rates in self._rates]
        return collected(self._space, [one for of_law in forces for one in of_law])

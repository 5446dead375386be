"""The defect of a nearly incompressible body, whose elements average the volumetric strain by vertex.

Bubbles on nodes that stay cannot keep the volume around each vertex: with the volumetric energy they are far too stiff,
without it far too soft. Bubbles and nodes together are displacements of twice the degree over linear pressures (at
degree 1 Taylor and Hood's), which lock nowhere. So the nodes are eliminated: each bubble moves with what the nodes
answer to it.
"""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem, la

from ...problem.problem import Problem
from ...runtime import forms
from ...typing import Array
from . import bubble_constraints, defect
from .bubble_stiffness import BubbleStiffness
from .dual_norm import DualNorm
from .law_springs import LawSprings
from .law_traces import ErrorField, LawTraces
from .thresholds import EstimateThresholds


class VertexStiffness(BubbleStiffness):
    """The bubbles' stiffness with the nodes that follow them and the averaged volumetric energy of both.

    The diagonal is that of the shear alone: a preconditioner. Creation is collective.

    Args:
        problem: whose elastic operator it is.
        bubbles: the space of bubbles.
        inverse: of the system, for the nodes.
        thresholds: how accurately.

    Attributes:
        at_nodes: the nodes' displacement, as :meth:`follow` found it last.
        pressures: the averaged volumetric stress of bubbles and nodes, by region.
    """

    def __init__(
        self, problem: Problem, bubbles: fem.FunctionSpace, inverse: DualNorm, thresholds: EstimateThresholds
    ) -> None:
        super().__init__(problem, bubbles)
        self._node_inverse, self._tolerance = inverse, thresholds.vertex_tolerance
        self.at_nodes = fem.Function(problem.space)
        bulk, moved = problem.bulk, self._in + self.at_nodes
        self.pressures = bulk.pressures(self.at_nodes)
        self._dilated = [forms.compiled(form) for form in bulk.dilated(moved)]
        tests = ufl.TestFunction(problem.space), ufl.TestFunction(bubbles)
        self._on_nodes, self._action = (
            forms.compiled(bulk.between(moved, v) + bulk.pressed(self.pressures, v)) for v in tests
        )

    def _product(self) -> Array:
        """As of :class:`.BubbleStiffness`, the nodes following. Collective."""
        self._let_follow()
        return super()._product()

    def follow(self, e: Array, unmet: Array) -> None:
        """Let the nodes follow the bubbles and a force, and the pressures both. Collective.

        Args:
            e: the bubbles, (n, d).
            unmet: the force on the nodes, (n, d).
        """
        self._owned(self._in)[:] = e
        self._let_follow(unmet)

    def _let_follow(self, unmet: Array | None = None) -> None:
        """As :meth:`follow`, of the bubbles that products are made of. Collective."""
        self._in.x.scatter_forward()
        self.at_nodes.x.array[:] = 0.0
        self._press()
        force = -self.problem.combined(_assembled(self._on_nodes, self.at_nodes))
        if unmet is not None:
            force += unmet
        self.at_nodes.x.array[:] = self._node_inverse.solve(force, self._tolerance)[0].x.array
        self._press()

    def _press(self) -> None:
        """The pressures of the bubbles and the nodes as they are. Collective."""
        parts = self.problem.bulk.dilatations
        for pressure, dilated, part in zip(self.pressures, self._dilated, parts, strict=True):
            average = _assembled(dilated, pressure).ravel()
            pressure.x.array[: len(average)] = part.stiffness.array_r * average
            pressure.x.scatter_forward()

    def on_bubbles(self, unmet: Array) -> Array:
        """What a force at the nodes leaves at the bubbles through the nodes, (n, d). Collective.

        Args:
            unmet: the force on the nodes, (n, d).
        """
        self._owned(self._in)[:] = 0.0
        self._let_follow(unmet)
        return super()._product()


def _assembled(form: fem.Form, like: fem.Function) -> Array:
    """A linear form's values at the owned blocks of a function's space, (n, block size). Collective."""
    vector = fem.assemble_vector(form)
    vector.scatter_reverse(la.InsertMode.add)
    dofs = like.function_space.dofmap
    found = vector.array[: dofs.index_map.size_local * dofs.index_map_bs]
    return np.array(found).reshape(-1, dofs.index_map_bs)


def squares(traces: LawTraces, inverse: DualNorm) -> Array:
    """η_K² of the owned cells: shear and volumetric energy of bubbles and nodes. Collective.

    Args:
        traces: the laws between the nodes.
        inverse: of the system.
    """
    problem, u = traces.problem, traces.u
    stiffness = VertexStiffness(problem, traces.bubbles, inverse, traces.thresholds)
    load = problem.bulk.residual_in(traces.bubbles, u, problem.linear.values())
    between, left = traces.tested()
    load[between.blocks] -= between.values
    unmet = left.everywhere(problem.space.dofmap.index_map.size_local)
    if problem.terms:
        load -= stiffness.on_bubbles(unmet)
    bubbles, under = fem.Function(traces.bubbles), bubble_constraints.constraints(problem, u, traces.bubbles)
    stiffness.hold(LawSprings(traces, ErrorField(fem.Function(problem.space), bubbles)))
    defect.find_least_energy(bubbles, stiffness, under, load, traces.thresholds)
    stiffness.follow(bubbles.x.array.reshape(-1, unmet.shape[1])[: len(load)], unmet)
    shear = problem.bulk.energy_by_cell(bubbles + stiffness.at_nodes)
    return shear + problem.bulk.pressure_energy(stiffness.pressures) + problem.bulk.dilatation_error(u)

"""What effects see of the problem while it is composed: arguments, measures, constants that are not compiled in."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import Any

import dolfinx
import numpy as np
import ufl
from dolfinx import fem
from petsc4py import PETSc

from ..effects import Place, SideMoments
from ..formula import SpatialValue
from ..mesh import curved, nodes
from ..mesh.domain import Domain
from ..runtime.mpi import agree
from ..typing import Array, Entities
from . import boundary_parts
from .scaling import Placed, Scales
from .spaces import LOAD_DEGREE, displacement_space, pressure_space


class DomainForms:
    """What effects see of the problem while it is composed (:class:`.effects.FormContext`)."""

    def __init__(
        self,
        domain: Domain,
        part_facets: Mapping[str, Entities],
        scales: Scales,
        effects: Sequence[Placed],
        degree: int = 1,
    ) -> None:
        self.domain, self.dimension = domain, domain.dimension
        self.length, self.stress, self.modulus = scales.length, scales.stress, scales.modulus
        self.space = _space(domain, degree)
        self.mesh = self.space.mesh
        self.trial, self.test = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        self.normal = ufl.FacetNormal(self.mesh)
        self.materials = [placed for placed in effects if placed[1].place is Place.MATERIAL]
        self.part_facets = dict(part_facets)

    @functools.cached_property
    def points(self) -> Array:
        """The local nodes (owned and ghost), m, (n, 3)."""
        return nodes.points(self.space)

    @functools.cached_property
    def points_on_curves(self) -> Array:
        """The local nodes, those of curved sides on their curves and off their facets, m, (n, 3)."""
        found, d = self.points.copy(), self.dimension
        for name, curve in self.domain.curves.items():
            on = np.unique(nodes.facet_nodes(self.space, self.domain.sides[name]))
            found[on, :d] = curve.nearest(found[on, :d])
        return found

    @functools.cached_property
    def scalar_test(self) -> Any:
        """A test function of scalar P1; few effects want it, and its space takes time."""
        return ufl.TestFunction(pressure_space(self.mesh))

    def number(self, value: float) -> Any:
        """A constant that is not compiled into the form."""
        return fem.Constant(self.mesh, PETSc.ScalarType(value))

    def render(self, value: SpatialValue) -> Any:
        """A value in UFL, in SI coordinates."""
        return value.in_ufl(self.mesh, self.number)

    @functools.cached_property
    def _facet_tags(self) -> tuple[Any, dict[str, tuple[int, ...]]]:
        return _tags(self.mesh, self.dimension - 1, self.part_facets)

    @functools.cached_property
    def _cell_tags(self) -> tuple[Any, dict[str, tuple[int, ...]]]:
        return _tags(self.mesh, self.dimension, dict(self.domain.regions))

    def cells(self, *regions: str | None) -> Any:
        """dx/L^d over what the regions share; None where that is nothing."""
        scale = self.number(self.length**-self.dimension)
        named = [region for region in regions if region is not None]
        if not named:
            return ScaledMeasure(scale, ufl.dx(domain=self.mesh))
        self.domain.cells(named)
        tags, ids = self._cell_tags
        shared = tuple(sorted(set.intersection(*(set(ids[region]) for region in named))))
        measure = ufl.Measure("dx", domain=self.mesh, subdomain_data=tags)
        return ScaledMeasure(scale, measure(shared)) if shared else None

    def facets(self, part: str, *values: SpatialValue) -> Any:
        """ds/L^(d-1), with a quadrature that sees how values vary within a facet.

        Args:
            part: its name.
            *values: what is integrated.
        """
        varying = any(not value.is_number for value in values)
        rule = {"quadrature_degree": LOAD_DEGREE[self.dimension]} if varying else {}
        return ScaledMeasure(self.number(self.length ** (1 - self.dimension)), self.boundary(part, **rule))

    def side_moments(self, part: str) -> SideMoments:
        """Area, centroid and second moments of a boundary part. Collective."""
        return boundary_parts.of(self.space, self.part_facets[part])

    def boundary(self, part: str, **metadata: Any) -> Any:
        """The measure ds over a part, SI.

        Args:
            part: its name.
            **metadata: of the measure, like the quadrature rule.
        """
        tags, ids = self._facet_tags
        measure = ufl.Measure("ds", domain=self.mesh, subdomain_data=tags, metadata=metadata)
        return measure(ids[part])


def _space(domain: Domain, degree: int) -> fem.FunctionSpace:
    """The displacements, one space for all problems of a degree on a shared mesh. Collective."""
    return domain.once(
        f"space of degree {degree}",
        None,
        lambda: displacement_space(curved.mesh_of(domain, degree), degree),
    )


class ScaledMeasure:
    """A measure with a factor: ``integrand * ScaledMeasure`` is ``factor * integrand * measure``."""

    def __init__(self, factor: Any, measure: Any) -> None:
        self.factor, self.measure = factor, measure

    def __rmul__(self, integrand: Any) -> Any:
        return self.factor * integrand * self.measure


def _tags(mesh: Any, dimension: int, parts: dict[str, Any]) -> tuple[Any, dict[str, tuple[int, ...]]]:
    """Mesh tags in which overlapping parts are unions of atoms. The atoms' numbers agree on all ranks. Collective."""
    names = sorted(parts)
    codes: dict[int, int] = {}
    for bit, name in enumerate(names):
        for entity in parts[name]:
            codes[int(entity)] = codes.get(int(entity), 0) | 1 << bit
    atoms = sorted({code for rank in agree(mesh.comm, set(codes.values())) for code in rank})
    number = {code: i + 1 for i, code in enumerate(atoms)}
    entities = np.array(sorted(codes), dtype=np.int32)
    values = np.array([number[codes[int(e)]] for e in entities], dtype=np.int32)
    ids = {n: tuple(number[c] for c in atoms if c >> bit & 1) for bit, n in enumerate(names)}
    return dolfinx.mesh.meshtags(mesh, dimension, entities, values), ids

"""What effects see of the problem while it is composed: arguments, measures, constants that are not compiled in."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import dolfinx
import numpy as np
import ufl
from dolfinx import fem
from petsc4py import PETSc

from ..effects import Place, SideMoments
from ..errors import InputError
from ..formula import SpatialValue
from ..mesh import curved, nodes
from ..mesh import facets as facet_sizes
from ..mesh.boundary_part import BoundaryPart
from ..mesh.domain import Domain
from ..runtime.mpi import agree, total
from ..typing import Array, Entities
from . import facets as boundary_facets
from .facets import Facets
from .scaling import Placed, Scales
from .spaces import LOAD_DEGREE, displacement_space, edge_share, global_numbers, pressure_space


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
        self.scales, self.length, self.stress, self.modulus = scales, scales.length, scales.stress, scales.modulus
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

    def gathered(self, local: Entities) -> Facets:
        """Facets of the surface whose cells this rank owns, and those of all other ranks. Collective.

        Args:
            local: local facets.
        """
        space, d, points = self.space, self.dimension, self.points[:, : self.dimension]
        local, cells, _ = facet_sizes.with_cells(self.domain.mesh, local)
        blocks, middles = nodes.facet_nodes(space, local), points[space.dofmap.list[cells][:, : d + 1]].mean(axis=1)
        normals = boundary_facets.outward(points[blocks[:, :d]], middles)
        parts = [global_numbers(space, blocks), points[blocks], normals]
        every = agree(self.mesh.comm, parts)
        numbers, places, normals = (np.concatenate([part[i] for part in every]) for i in range(3))
        order = np.lexsort(np.round(places[:, :d].mean(axis=1) / self.length, 12).T)
        return Facets(
            nodes=numbers[order].astype(np.int64),
            points=places[order],
            normals=normals[order],
            share=edge_share(space),
        )

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
        return _tags(self.mesh, self.dimension, self.domain.regions)

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
        return of(self.space, self.part_facets[part])

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


def _tags(mesh: Any, dimension: int, parts: Mapping[str, Any]) -> tuple[Any, dict[str, tuple[int, ...]]]:
    """Mesh tags in which overlapping parts are unions of atoms. The atoms' numbers agree on all ranks. Collective."""
    entities = np.unique(np.concatenate(list(parts.values())))
    within = np.column_stack([np.isin(entities, parts[name]) for name in sorted(parts)])
    others = agree(mesh.comm, np.unique(within, axis=0))
    atoms, number = np.unique(np.concatenate([within, *others]), axis=0, return_inverse=True)
    values = number.ravel()[: len(entities)].astype(np.int32) + 1
    ids = {n: tuple(int(i) + 1 for i in np.flatnonzero(of)) for n, of in zip(sorted(parts), atoms.T, strict=True)}
    return dolfinx.mesh.meshtags(mesh, dimension, entities, values), ids


def find(domain: Domain, parts: Mapping[str, BoundaryPart], effects: Sequence[Placed]) -> dict[str, Entities]:
    """The local facets of each part. Collective.

    Args:
        domain: the body and its mesh.
        parts: by name.
        effects: with their places.

    Raises:
        InputError: on all ranks alike: a part without facets, or two pieces with one effect that share facets.
    """
    found = {name: part.facets(domain) for name, part in parts.items()}
    for name, facets in found.items():
        if not sum(agree(domain.mesh.comm, len(facets))):
            raise InputError(
                f"boundary.{name}: no facet has its midpoint there; see `on` and `where`, or take smaller cells"
            )
    _check_overlap(domain, found, effects)
    return found


def _check_overlap(domain: Domain, facets: Mapping[str, Entities], effects: Sequence[Placed]) -> None:
    """A facet bears one effect of an exclusive kind. Collective."""
    placed = [(where, e) for where, e in effects if e.place is Place.BOUNDARY and e.exclusive and where is not None]
    for (one, effect), (other, second) in combinations(placed, 2):
        if (key := effect.key) != second.key:
            continue
        if any(agree(domain.mesh.comm, len(np.intersect1d(facets[one], facets[other])))):
            raise InputError(f"boundary.{other}.{key}: shares facets with boundary.{one}, which has {key} already")


def of(space: fem.FunctionSpace, facets: Entities) -> SideMoments:
    """The moments of a part. Collective.

    Args:
        space: of the displacements.
        facets: the part's local facets (owned and ghost).
    """
    points, weights, _ = boundary_facets.samples(space, facet_sizes.owned(space.mesh, facets))
    return of_points(space.mesh.comm, points.reshape(-1, points.shape[2]), weights.ravel())


def of_points(comm: Any, points: Array, weights: Array) -> SideMoments:
    """The moments of weighted points of all ranks. Collective.

    Args:
        comm: the ranks.
        points: m, (p, d).
        weights: the area that each of them stands for, m² (m in 2D), (p,).
    """
    area = total(comm, float(weights.sum()))
    centroid = comm.allreduce(weights @ points) / area
    r = points - centroid
    return SideMoments(area=area, centroid=centroid, second=comm.allreduce(np.einsum("p,pi,pj->ij", weights, r, r)))

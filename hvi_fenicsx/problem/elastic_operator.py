"""The elastic operator a(u, v): matrix, force, energy by cell, residual in other test spaces, stress by cell.

How the volumetric part is treated is known here and nowhere else; the element itself in :mod:`.spaces`.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem.petsc import assemble_matrix
from petsc4py import PETSc

from ..effects import Averaged, Contribution, Effect, Place
from ..mesh import nodes
from ..mesh.domain import SharedObjects
from ..rigid import RigidBody, rigid_fields
from ..runtime import forms
from ..runtime.mpi import total
from ..typing import Array, Entities
from . import spaces
from .scaling import DEFAULT, Scales
from .spaces import Dilatation, coefficients_of
from .vectors import LinearForm, nodal, nodal_values


def feels_no_rigid_motion(form: Any, space: fem.FunctionSpace) -> bool:
    """Whether a bilinear form is zero for every rigid motion. Collective.

    Args:
        form: a(u, v) in UFL.
        space: of its arguments.
    """
    points, d = coefficients_of(space, nodes.points(space)), space.mesh.geometry.dim
    field = fem.Function(space)
    compiled = forms.compiled(ufl.action(form, field))

    def force(values: Array) -> float:
        field.x.array[:] = values.ravel()
        return float(np.sqrt(total(space.mesh.comm, float(np.sum(nodal_values(compiled) ** 2)))))

    motions = rigid_fields(points, RigidBody(dimension=d, centre=np.zeros(3)))
    sizes = [force(motions[:, k]) for k in range(motions.shape[1])]
    return max(sizes) <= DEFAULT.same * force(points[:, :d])


def on_cells(form: Any, cells: Entities) -> Any:
    """A UFL form of integrals over cells, restricted to some of them.

    Args:
        form: its subdomain data are mesh tags, or none.
        cells: local numbers.
    """
    data: list[tuple[int, Entities]] = []
    restricted = []
    for number, integral in enumerate(form.integrals(), start=1):
        data.append((number, _shared(integral, cells)))
        restricted.append(integral.reconstruct(subdomain_id=number, subdomain_data=data))
    return ufl.Form(restricted)


def _shared(integral: Any, cells: Entities) -> Entities:
    """The cells among some over which an integral goes, ascending."""
    tags, ids = integral.subdomain_data(), integral.subdomain_id()
    if tags is None:
        return np.unique(cells).astype(np.int32)
    wanted = ids if isinstance(ids, tuple) else (ids,)
    return np.intersect1d(cells, np.concatenate([tags.find(i) for i in wanted])).astype(np.int32)


def stiffness_tensor(bulk: Bulk, cells: Entities) -> Array:
    """C_ijkl of owned cells, nondimensional, (c, d, d, d, d). Collective.

    It is the work of the stress of one uniform strain in another one, over the cell's size. A uniform dilatation is its
    own average by vertex.

    Args:
        bulk: the elastic operator.
        cells: the owned cells; no other is looked at.
    """
    mesh, d = bulk.space.mesh, bulk.scales.dimension
    one, other = (fem.Constant(mesh, np.zeros((d, d))) for _ in range(2))
    whole = on_cells(bulk.uniform_work(one, other), cells)
    size = on_cells(bulk.in_cells(ufl.dx(domain=mesh)), cells)
    sizes, work = LinearForm(size).values()[cells, 0], LinearForm(whole)
    found = np.zeros((len(cells), *[d] * 4))
    strains = list(itertools.combinations_with_replacement(range(d), 2))
    for (i, j), (k, m) in itertools.combinations_with_replacement(strains, 2):
        one.value[...], other.value[...] = _strain(d, k, m), _strain(d, i, j)
        entry = work.values()[cells, 0] / sizes * bulk.scales.length**d
        for (a, b), (p, q) in itertools.product({(i, j), (j, i)}, {(k, m), (m, k)}):
            found[:, a, b, p, q] = found[:, p, q, a, b] = entry
    return found


def _strain(d: int, i: int, j: int) -> Array:
    """The strain whose work with a stress is its component ij."""
    strain = np.zeros((d, d))
    strain[i, j] += 0.5
    strain[j, i] += 0.5
    return strain


T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class Bulk:
    """The elastic operator of a problem, nondimensional.

    Attributes:
        space: the displacements, P1 vectors.
        scales: what one unit is in SI.
        form: a(u, v) in UFL, but for the volumetric part that is averaged by vertex.
        material: the part of ``form`` that depends on ε(u) and ε(v) only: a material's, not an elastic support's.
        foundation: the other part of it; None where there is none.
        averaged: the volumetric parts that are averaged by vertex, in nearly incompressible regions.
        strains: linear forms of ε(v) (thermal strain) by the name of their load; no rigid motion feels them.
        across: parts of ∫ σ_33 q dx in a plane body (:attr:`.Contribution.across`).
        origin: what the operator is made from: two bulks of one mesh with equal origins have equal matrices.
        shared: where problems on one mesh share what an equal origin makes equal; None: each makes its own.
    """

    space: fem.FunctionSpace
    scales: Scales
    form: Any
    material: Any
    foundation: Any
    averaged: tuple[Averaged, ...]
    strains: Mapping[str, Any]
    across: tuple[Any, ...]
    origin: tuple[Any, ...] = ()
    shared: SharedObjects | None = None

    @functools.cached_property
    def compiled(self) -> fem.Form:
        """The compiled ``form``. Collective when first used."""
        return self._once("elastic form", lambda: forms.compiled(self.form))

    @functools.cached_property
    def _internal(self) -> tuple[fem.Form, fem.Function]:
        """The compiled form a(u, ·), and its u: much quicker than to derive the form for each u."""
        displacement = fem.Function(self.space)
        return self._once("elastic force", lambda: (forms.compiled(ufl.action(self.form, displacement)), displacement))

    @functools.cached_property
    def dilatations(self) -> list[Dilatation]:
        """The regions in ``averaged``, assembled. Collective when first used."""
        return [spaces.assemble(part) for part in self.averaged]

    def without_dilatation(self) -> Bulk:
        """The operator without what is averaged by vertex."""
        return replace(self, averaged=(), shared=None)

    @property
    def volumetric_ratio(self) -> float:
        """The largest λ/μ of regions where div u is averaged; 0 where there are none."""
        return max((part.ratio for part in self.averaged), default=0.0)

    def matrix(self) -> PETSc.Mat:
        """The stiffness matrix, a new one without conditions; block size d. Collective."""
        return self._assembled() if self.shared is None else self._once("stiffness", self._assembled).copy()

    def _once(self, name: str, make: Callable[[], T]) -> T:
        """What all bulks of equal origin share. Collective."""
        if self.shared is None:
            return make()
        name = f"{name} of degree {nodes.degree(self.space)}"
        return self.shared.get(self.space.mesh.comm, name, self.origin, make)

    def _assembled(self) -> PETSc.Mat:
        matrix = assemble_matrix(self.compiled)
        matrix.assemble()
        return spaces.add(matrix, self.dilatations)

    def between(self, u: Any, v: Any) -> Any:
        """The UFL form a(u, v), without what is averaged by vertex.

        Args:
            u: a displacement or trial function of any space.
            v: a displacement or test function of any space.
        """
        test, trial = self.form.arguments()
        return ufl.replace(self.form, {test: v, trial: u})

    def force(self, u: fem.Function) -> Array:
        """a(u, v) of the P1 test functions v at the blocks that this rank owns, (n, d). Collective."""
        form, displacement = self._internal
        displacement.x.array[:] = u.x.array
        internal = nodal_values(form)
        for part in self.dilatations:
            internal += part.force(u).reshape(internal.shape)
        return internal

    def foundation_force(self, u: fem.Function) -> Array:
        """The part of :meth:`force` that no strain makes: of elastic supports of the body, (n, d). Collective."""
        if self.foundation is None:
            return np.zeros((self.space.dofmap.index_map.size_local, self.scales.dimension))
        return nodal(ufl.action(self.foundation, u))

    def force_in(self, space: fem.FunctionSpace, u: Any) -> LinearForm:
        """a(u, v) of the test functions v of any vector space, without what is averaged by vertex. Collective.

        Args:
            space: of the test functions.
            u: a displacement of any space, or a sum of such, ghosts updated when the form is evaluated.
        """
        return LinearForm(self.between(u, ufl.TestFunction(space)))

    def residual_in(self, space: fem.FunctionSpace, u: fem.Function, loads: Iterable[Any]) -> Array:
        """<g, v> - a(u, v) of the test functions v of any vector space. Collective.

        Args:
            space: of the test functions.
            u: P1, ghosts updated.
            loads: UFL linear forms, whose sum is g.

        Returns:
            The residual at the blocks that this rank owns, (n, d).
        """
        v, test = ufl.TestFunction(space), self.form.arguments()[0]
        each = [-self.between(u, v), *(ufl.replace(load, {test: v}) for load in loads)]
        form = ufl.Form([integral for part in each for integral in part.integrals()])
        for part in self.dilatations:
            form -= part.work(part.pressure(u), v)
        return nodal(form)

    @functools.cached_property
    def _constants(self) -> fem.FunctionSpace:
        """Functions that are constant in cells."""
        return fem.functionspace(self.space.mesh, ("Discontinuous Lagrange", 0))

    def in_cells(self, measure: Any) -> Any:
        """The UFL form ∫ q dx, q being the test function that is constant in cells.

        Args:
            measure: dx.
        """
        return ufl.TestFunction(self._constants) * measure

    def uniform_work(self, one: Any, other: Any) -> Any:
        """The UFL form of the work of a uniform strain's stress in another one, by cell.

        Args:
            one: a constant strain, (d, d).
            other: the same.
        """
        place, q = ufl.SpatialCoordinate(self.space.mesh) / self.scales.length, ufl.TestFunction(self._constants)
        test, trial = self.form.arguments()
        u, v = ufl.dot(one, place), q * ufl.dot(other, place)
        form = ufl.replace(self.material, {test: v, trial: u})
        return form + sum(
            (part.work(part.averaged.modulus * ufl.tr(one), v) for part in self.dilatations), ufl.Form([])
        )

    def energy_by_cell(self, v: Any) -> Array:
        """a(v, v) of every owned cell, without what is averaged, not negative, (cells,). Collective.

        Args:
            v: a displacement of any space, or a sum of such in UFL.
        """
        q, integrals = ufl.TestFunction(self._constants), self.between(v, v).integrals()
        form = ufl.Form([one.reconstruct(integrand=one.integrand() * q) for one in integrals])
        return np.maximum(nodal(form)[:, 0], 0.0)

    def pressures(self, u: fem.Function) -> list[fem.Function]:
        """The averaged volumetric stress of each region in ``averaged``, P1 fields. Collective."""
        return [part.pressure(u) for part in self.dilatations]

    def pressed(self, pressures: Sequence[fem.Function], v: Any) -> Any:
        """The UFL form of the work of averaged volumetric stresses in v.

        Args:
            pressures: P1 fields, by region in ``averaged``.
            v: a displacement or test function of any space.
        """
        return sum((part.work(p, v) for part, p in zip(self.dilatations, pressures, strict=True)), ufl.Form([]))

    def pressure_energy(self, pressures: Sequence[fem.Function]) -> Array:
        """∫ p²/λ of every owned cell, (cells,). Collective.

        Args:
            pressures: P1 fields p, by region in ``averaged``.
        """
        q = ufl.TestFunction(self._constants)
        pairs = zip(self.dilatations, pressures, strict=True)
        return np.sum([nodal(part.tested(p * (p * q)))[:, 0] / part.averaged.modulus for part, p in pairs], axis=0)

    def dilatation_error(self, u: fem.Function) -> Array:
        """2μ/d ∫ (div u - p/λ)² of every owned cell, p being the averaged volumetric stress, (cells,). Collective.

        It is the residual of the equation that says what p is, by the least shear energy of a strain with that trace.
        """
        cells = self.space.mesh.topology.index_map(self.scales.dimension).size_local
        return sum((part.error(u) for part in self.dilatations), np.zeros(cells))


def make_bulk(
    space: fem.FunctionSpace,
    scales: Scales,
    made: Sequence[tuple[str | None, Effect, Contribution]],
    strains: Mapping[str, Any],
    shared: SharedObjects | None = None,
    volumetric_ratio: float = np.inf,
) -> Bulk:
    """The elastic operator that effects contribute. Collective.

    A form that an effect other than a material brings belongs to the stress where it feels no rigid motion.

    Args:
        space: the displacements, P1 vectors.
        scales: what one unit is in SI.
        made: the effects, each with its place and what it contributes.
        strains: their linear forms of ε(v), by the name of the load.
        shared: where problems on one mesh share what an equal origin makes equal; None: each makes its own.
        volumetric_ratio: λ/μ where div u is averaged, at most.
    """
    averaged = tuple(part.softened(volumetric_ratio) for _, _, c in made for part in c.averaged)
    elastic = tuple((where, effect) for where, effect, c in made if c.bilinear or c.averaged)
    brought = [(form, effect.place is Place.MATERIAL) for _, effect, c in made for form in c.bilinear]
    strained = [own or feels_no_rigid_motion(form, space) for form, own in brought]
    foundations = [form for (form, _), of_strain in zip(brought, strained, strict=True) if not of_strain]
    return Bulk(
        space=space,
        scales=scales,
        form=sum(form for form, _ in brought),
        material=sum(form for (form, _), of_strain in zip(brought, strained, strict=True) if of_strain),
        foundation=sum(foundations) if foundations else None,
        averaged=averaged,
        strains=strains,
        across=tuple(form for _, _, c in made for form in c.across),
        origin=(nodes.degree(space), scales.length, scales.modulus, *(part.ratio for part in averaged), *elastic),
        shared=shared,
    )

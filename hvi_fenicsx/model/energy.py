"""An elasticity by a user's own bilinear form, and what is checked of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from dolfinx.fem.petsc import assemble_matrix
from petsc4py import PETSc
from pydantic import Field
from typing_extensions import override
from ufl.algorithms.analysis import extract_type
from ufl.constantvalue import RealValue

from ..effects import Contribution, Effect, FormContext, Place, Sides, from_python
from ..errors import InputError, of_user
from ..geometry import ROUNDING
from ..mesh import nodes
from ..problem.elastic_operator import feels_no_rigid_motion
from ..problem.spaces import displacement_space
from ..runtime import forms
from ..typing import Array


class Energy(Effect):
    """An elasticity by a bilinear form of the user's own: twice its energy is form(u, u).

    The form is in SI (J/m in 2D, J in 3D), of a trial function u and a test function v in m, and must depend on their
    strains only. Where other materials are elsewhere, it must itself integrate over its region.
    """

    key = "energy"
    place = Place.MATERIAL
    in_files: ClassVar[bool] = False
    term = "a(u, v), a form of the user's own"

    form: Callable[..., Any] = Field(exclude=True)
    """makes the form of trial and test function, SI"""
    modulus: float = 0.0
    """the stiffness against stretches, N/m²; known on a mesh"""

    @from_python
    def __init__(self, form: Callable[..., Any], region: Sides | None = None) -> None:
        self._make(region, form=form)

    @override
    def on_mesh(self, mesh: dmesh.Mesh) -> Energy:
        """Itself with its stiffness, its form being symmetric and without energy of rigid motions. Collective."""
        space = displacement_space(mesh)
        with of_user("the form cannot be used; it must be bilinear in u and v, its data on body.mesh"):
            form = self.form(ufl.TrialFunction(space), ufl.TestFunction(space))
            if not isinstance(form, ufl.Form) or len(form.arguments()) != 2:
                raise InputError("the function must return a bilinear UFL form a(u, v), such as inner(σ(u), ε(v))*dx")
            if not np.all(np.isfinite([float(number) for number in extract_type(form, RealValue)])):
                raise InputError("a number in the form is not finite")
            try:
                matrix = assemble_matrix(forms.compiled(form))
            except forms.CompilationError as error:
                raise InputError(f"the form cannot be used: {error}") from error
        matrix.assemble()
        _check_symmetry(matrix)
        stiffness = _stiffness(matrix, space)
        matrix.destroy()
        if not feels_no_rigid_motion(form, space):
            raise InputError(
                "a rigid motion costs energy, as none of an elastic body must; write the form in the strain "
                "sym(grad(u)), and what holds the body as a Displacement, Contact or Support"
            )
        return self.model_copy(update={"modulus": stiffness})

    @override
    def modulus_scale(self) -> float:
        """The stiffness against stretches."""
        return self.modulus

    @override
    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        """The form, nondimensional."""
        factor = context.number(context.length ** (2 - context.dimension) / context.modulus)
        return Contribution(bilinear=(factor * self.form(context.trial, context.test),))

    def is_portable(self, mesh: dmesh.Mesh) -> bool:
        """Whether the same form can be made on another mesh: it has no data of this one.

        Args:
            mesh: the body's mesh.
        """
        space = displacement_space(mesh)
        form = self.form(ufl.TrialFunction(space), ufl.TestFunction(space))
        measured = any(integral.subdomain_data() is not None for integral in form.integrals())
        return not (form.coefficients() or form.constants() or measured)


def _check_symmetry(matrix: PETSc.Mat) -> None:
    transposed = matrix.transpose(PETSc.Mat())
    transposed.axpy(-1.0, matrix)
    gap, size = transposed.norm(PETSc.NormType.FROBENIUS), matrix.norm(PETSc.NormType.FROBENIUS)
    transposed.destroy()
    if not size > 0.0:
        raise InputError("the form is zero, or no number, on this body")
    if not gap <= ROUNDING * size:
        raise InputError(
            f"the form is not symmetric: a(u, v) and a(v, u) differ by {gap / size:.1e} of its size; an energy "
            "is, such as a(u, v) = ∫ C ε(u) : ε(v) dx with a symmetric C"
        )


def _stiffness(matrix: PETSc.Mat, space: fem.FunctionSpace) -> float:
    """The largest energy of a unit stretch over the volume, N/m². Collective."""
    comm, d = space.mesh.comm, space.mesh.geometry.dim
    points = nodes.points(space)[: space.dofmap.index_map.size_local]
    one = fem.Constant(space.mesh, PETSc.ScalarType(1.0))
    volume = comm.allreduce(fem.assemble_scalar(forms.compiled(one * ufl.dx)))
    stretches = [_energy(matrix, points[:, i : i + 1] * np.eye(d)[i]) / volume for i in range(d)]
    if not min(stretches) > 0.0:
        axis = "xyz"[int(np.argmin(stretches))]
        raise InputError(f"a stretch along {axis} costs no energy (a(v, v) = {min(stretches):.3g}); it must")
    return float(max(stretches))


def _energy(matrix: PETSc.Mat, field: Array) -> float:
    """a(v, v) of a field at the owned vertices, (n, d). Collective."""
    x, y = matrix.createVecs()
    x.array[:] = field.ravel()
    matrix.mult(x, y)
    return float(x.dot(y))

"""PETSc vectors: made, assembled, turned into local components, spanning a null space."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl
from dolfinx import fem, la
from dolfinx.fem.petsc import assemble_vector
from petsc4py import PETSc

from ..runtime import forms
from ..typing import Array, Entities


def new_vector(space: fem.FunctionSpace) -> PETSc.Vec:
    """A zero vector of a space, with ghosts. Collective."""
    function = fem.Function(space)  # must outlive the duplication: its vector does not own the memory
    vector = function.x.petsc_vec.duplicate()
    vector.set(0.0)
    return vector


def assembled(form: fem.Form) -> PETSc.Vec:
    """A compiled linear form's vector. Collective."""
    vector = assemble_vector(form)
    vector.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
    return vector


def nodal_values(compiled: fem.Form) -> Array:
    """A compiled linear form's values at the blocks that this rank owns, (n, d). Collective."""
    dofs = compiled.function_spaces[0].dofmap
    vector = fem.assemble_vector(compiled)
    vector.scatter_reverse(la.InsertMode.add)
    return vector.array.reshape(-1, dofs.index_map_bs)[: dofs.index_map.size_local]


def nodal(form: Any) -> Array:
    """As :func:`nodal_values`, of a UFL form whose integrals may have different subdomain data. Collective."""
    return LinearForm(form).values()


class LinearForm:
    """A UFL linear form, compiled once for all values of its coefficients. Creation is collective.

    Args:
        form: its integrals may have different subdomain data.
    """

    def __init__(self, form: Any) -> None:
        groups: dict[int, list[Any]] = {}
        for integral in form.integrals():
            groups.setdefault(id(integral.subdomain_data()), []).append(integral)
        self._parts = [forms.compiled(ufl.Form(integrals)) for integrals in groups.values()]

    def values(self) -> Array:
        """The values at the blocks that this rank owns, (n, d), with the coefficients as they are. Collective."""
        return functools.reduce(np.add, map(nodal_values, self._parts))


def turn(vector: PETSc.Vec, rotation: PETSc.Mat | None) -> None:
    """Take Cartesian components over to local ones, Qᵀ v, in place. Collective.

    Args:
        vector: v.
        rotation: Q; None where both are the same.
    """
    if rotation is not None:
        cartesian = vector.copy()
        rotation.multTranspose(cartesian, vector)
        cartesian.destroy()


def product(x: PETSc.Vec, *matrices: PETSc.Mat | None) -> Array:
    """This rank's part of the product of matrices with a vector, one after the other. Collective.

    Args:
        x: the vector.
        matrices: the first one is applied first; None: the identity.
    """
    made = [x]
    for matrix in matrices:
        if matrix is not None:
            made.append(matrix * made[-1])
    found = np.array(made[-1].array_r)
    for vector in made[1:]:
        vector.destroy()
    return found


def null_space(vectors: list[PETSc.Vec]) -> PETSc.NullSpace:
    """What these vectors span; they are made orthonormal (Gram and Schmidt), in place. Collective."""
    for i, vector in enumerate(vectors):
        for other in vectors[:i]:
            vector.axpy(-vector.dot(other), other)
        vector.normalize()
    return PETSc.NullSpace().create(vectors=vectors, comm=vectors[0].comm)


@dataclass(frozen=True)
class NodalForces:
    """Forces at some of the vertices that this rank owns (m of them).

    Attributes:
        blocks: local indices of the vertices, ascending, (m,).
        values: the forces, (m, d).
    """

    blocks: Entities
    values: Array

    @classmethod
    def of(cls, values: Array) -> NodalForces:
        """Those that are not zero, of forces at all vertices that this rank owns, (n, d)."""
        blocks = np.flatnonzero(values.any(axis=1)).astype(np.int32)
        return cls(blocks, values[blocks])

    def at(self, blocks: Entities) -> Array:
        """The forces at k vertices, zero where there is none, (k, d).

        Args:
            blocks: their local indices, each once, (k,).
        """
        found = np.zeros((len(blocks), self.values.shape[1]))
        _, there, here = np.intersect1d(blocks, self.blocks, assume_unique=True, return_indices=True)
        found[there] = self.values[here]
        return found

    def __add__(self, other: NodalForces) -> NodalForces:
        blocks = np.union1d(self.blocks, other.blocks).astype(np.int32)
        return NodalForces(blocks, self.at(blocks) + other.at(blocks))

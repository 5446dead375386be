"""Factorisations of a system's matrix, in which unknowns are held and slopes are added on Γc.

The volumetric part of a nearly incompressible body joins each vertex to the neighbours of its neighbours. At degree 2
factors are far smaller with the averaged pressures as further unknowns, and rounding loses less.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from petsc4py import PETSc
from typing_extensions import override

from ..mesh import nodes
from ..problem.spaces import Dilatation
from ..runtime.cost import Timer
from ..typing import Array, Entities, Integers
from .jacobian import ContactRows
from .petsc_options import CHOLESKY, applied_by, default_options, prefix
from .system import System


class FactorForm:
    """The system's matrix in the form in which it is factorised.

    Args:
        system: the system.

    Attributes:
        system: the system.
        has_pressures: whether averaged pressures are unknowns, on any rank.
        pressures: unknowns of this rank that follow its displacements.
    """

    has_pressures = False

    def __init__(self, system: System) -> None:
        self.system, self.pressures = system, 0

    @property
    def columns(self) -> Sequence[PETSc.Mat]:
        """The columns of the displacements, in blocks of rows: first those of the displacements."""
        return (self.system.jacobian.matrix,)

    @property
    def contact_rows(self) -> ContactRows:
        """The displacements' rows of Γc."""
        return self.system.jacobian.rows

    def matrix(self) -> PETSc.Mat:
        """A copy of the present matrix. Collective."""
        return self.system.jacobian.matrix.copy()

    def refresh(self, matrix: PETSc.Mat) -> None:
        """Copy the present matrix into an earlier copy. Collective."""
        self.system.jacobian.matrix.copy(matrix, structure=PETSc.Mat.Structure.SAME_NONZERO_PATTERN)

    def suiting(self, own_prefix: str) -> FactorForm:
        """This form, or the system's own matrix where the user chose another solver, for which pressures are not meant.

        Args:
            own_prefix: of the options of the factorisation.
        """
        return FactorForm(self.system) if _is_chosen(own_prefix) else self

    def free(self) -> None:
        """Free the PETSc objects that the form has of its own. Collective."""


class SaddlePointForm(FactorForm):
    """The matrix of displacements and averaged pressures. Creation is collective.

    Args:
        system: of a body whose div u is averaged; nothing is held by its matrix.
    """

    has_pressures = True

    def __init__(self, system: System) -> None:
        super().__init__(system)
        parts = system.problem.bulk.dilatations
        self._shear = without_dilatation(system)
        self._blocks = nested(system, self._shear, parts)
        self.pressures = sum(part.stiffness.local_size for part in parts)

    @property
    @override
    def columns(self) -> Sequence[PETSc.Mat]:
        return [self._blocks.getNestSubMatrix(i, 0) for i in range(self._blocks.getNestSize()[0])]

    @property
    @override
    def contact_rows(self) -> ContactRows:
        return self._shear.jacobian.rows

    def _update(self) -> None:
        nothing = np.empty(0, dtype=np.int32)
        self._shear.jacobian.set_restricted(self.system.jacobian.rows.tangent, nothing)

    @override
    def matrix(self) -> PETSc.Mat:
        self._update()
        return self._blocks.convert("aij", out=PETSc.Mat())

    @override
    def refresh(self, matrix: PETSc.Mat) -> None:
        self._update()
        self._blocks.convert("aij", out=matrix)

    @override
    def free(self) -> None:
        self._blocks.destroy()
        self._shear.free()


def _is_chosen(own_prefix: str) -> bool:
    """Whether the user chose the solver of factorisations with this prefix."""
    return bool(PETSc.Options().hasName(f"{prefix()}{own_prefix}pc_type"))


def form_of(system: System, own_prefix: str = "") -> FactorForm:
    """The form in which factors of a system's matrix are smallest. Collective.

    Args:
        system: the system.
        own_prefix: of the options of its factorisation: the form with pressures suits no solver that the user chose.
    """
    quadratic = nodes.degree(system.problem.space) > 1
    if quadratic and system.problem.bulk.averaged and not _is_chosen(own_prefix):
        return SaddlePointForm(system)
    return FactorForm(system)


class Factorisation:
    """The factors of a matrix. Creation is collective.

    They keep their memory and the order of elimination when values change.

    Args:
        form: of the matrix.
        matrix: of that form, which is changed.
        options: defaults of the factorisation's options.
        own_prefix: of the options by which the user changes them, after that of all options.

    Attributes:
        pc: the PC of the matrix in its form.
    """

    def __init__(
        self,
        form: FactorForm,
        matrix: PETSc.Mat,
        options: Mapping[str, object] = CHOLESKY,
        own_prefix: str = "",
    ) -> None:
        self._form, self._matrix, self._options, self._own_prefix = form, matrix, options, own_prefix
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        self._given, self._found = matrix.createVecLeft(), matrix.createVecLeft()
        self.pc = PETSc.PC().create(form.system.comm)
        self.pc.setOptionsPrefix(f"{prefix()}{own_prefix}")
        self.pc.setOperators(matrix)

    def refresh(self) -> None:
        """Take over the system's present matrix. Collective."""
        self._form.refresh(self._matrix)

    def add(self, at: Entities | Integers, values: Array) -> None:
        """Add to the diagonal. Collective.

        Args:
            at: local unknowns of the system.
            values: at these.
        """
        self._given.set(0.0)
        self._given.array[at] = values
        self._matrix.setDiagonal(self._given, PETSc.InsertMode.ADD_VALUES)

    def factorise(self, held: Entities | Integers) -> None:
        """Hold unknowns: their rows and columns become those of the identity; factorise. Collective.

        Args:
            held: local unknowns of the system.
        """
        rows = held + self._matrix.getOwnershipRange()[0]
        self._matrix.zeroRowsColumns(rows.astype(PETSc.IntType), diag=1.0)
        if self.pc.getFailedReason():  # MUMPS does not factorise again what has failed
            self.pc.reset()
            self.pc.setOperators(self._matrix)
        with default_options(self._options, self._own_prefix):
            self.pc.setFromOptions()
            self.pc.setUp()

    def allow_negative(self) -> None:
        """Let eigenvalues be negative; the system's matrix is known to be positive definite, its form may not be."""
        self._matrix.setOption(PETSc.Mat.Option.SPD, False)

    def apply(self, right: PETSc.Vec, found: PETSc.Vec) -> None:
        """Solve for the system's unknowns. Collective.

        Args:
            right: the right-hand side.
            found: where the solution is written.
        """
        count = right.local_size
        self._given.set(0.0)
        self._given.array[:count] = right.array_r
        self.pc.apply(self._given, self._found)
        found.array[:] = self._found.array_r[:count]

    def columns(self, right: Array) -> Array:
        """Solve for several right-hand sides. Collective.

        Args:
            right: this rank's rows, (local unknowns and pressures, k).
        """
        given = np.array(right, order="F")
        sizes = ((len(given), PETSc.DECIDE), (PETSc.DECIDE, given.shape[1]))
        b = PETSc.Mat().createDense(sizes, array=given, comm=self._form.system.comm)
        x = PETSc.Mat().createDense(sizes, comm=self._form.system.comm)
        for matrix in (b, x):
            matrix.assemble()
        self.pc.getFactorMatrix().matSolve(b, x)
        found = np.array(x.getDenseArray())
        b.destroy()
        x.destroy()
        return found

    @property
    def negative(self) -> int:
        """The number of negative eigenvalues of the system's matrix, by those of pivots (Sylvester). Collective."""
        pivots = int(self.pc.getFactorMatrix().getMumpsInfog(_NEGATIVE_PIVOTS))
        return pivots - int(self._form.system.comm.allreduce(self._form.pressures))

    @property
    def is_singular(self) -> bool:
        """Whether a pivot is zero."""
        return bool(self.pc.getFactorMatrix().getInertia()[1])

    @property
    def failure(self) -> int:
        """PETSc's reason why it failed; 0 where it did not."""
        return int(self.pc.getFailedReason())

    def free(self) -> None:
        """Free the PETSc objects."""
        for thing in (self.pc, self._matrix, self._given, self._found):
            thing.destroy()


_FACTOR_ENTRIES = 29  # INFOG: numbers in the factors; in millions with a minus, where they are many
_NEGATIVE_PIVOTS = 12  # INFOG


def entries(pc: PETSc.PC) -> float:
    """Numbers in the factors, over all ranks; infinite where the solver does not tell.

    Args:
        pc: a factorised matrix.
    """
    if pc.getFactorSolverType() != "mumps":
        return np.inf
    count = pc.getFactorMatrix().getMumpsInfog(_FACTOR_ENTRIES)
    return float(count if count >= 0 else -1e6 * count)


def without_dilatation(system: System) -> System:
    """The system without the volumetric part. Collective.

    Args:
        system: of a body whose div u is averaged.
    """
    problem = replace(system.problem, bulk=system.problem.bulk.without_dilatation())
    return System(problem, Timer(), system.thresholds)


def nested(system: System, shear: System, parts: Sequence[Dilatation]) -> PETSc.Mat:
    """The matrix of displacements and pressures, in blocks. Collective.

    Args:
        system: the system.
        shear: the same without the volumetric part; its matrix is the first block.
        parts: the regions that are averaged.
    """
    divergences = [_in_unknowns(part.divergence, system) for part in parts]
    transposed, compliances = [d.transpose(PETSc.Mat()) for d in divergences], [_compliance(part) for part in parts]
    rows = [
        [d, *(compliance if i == k else None for i in range(len(parts)))]
        for k, (d, compliance) in enumerate(zip(divergences, compliances, strict=True))
    ]
    found = PETSc.Mat().createNest([[shear.jacobian.matrix, *transposed], *rows], comm=system.comm)
    for block in (*divergences, *transposed, *compliances):
        block.destroy()  # they are found's alone
    return found


def _in_unknowns(divergence: PETSc.Mat, system: System) -> PETSc.Mat:
    """D of the system's unknowns; prescribed ones have no part in it. Collective."""
    coupling, found = system.problem.coupling, divergence.copy()
    for step in (coupling and coupling.matrix, system.rotation):
        if step is not None:
            found = found.matMult(step)
    found.diagonalScale(None, system.unprescribed())
    return found


def _compliance(part: Dilatation) -> PETSc.Mat:
    """-V/λ; -1 at the vertices outside of the region, whose pressure is zero. Collective."""
    rate, found = part.stiffness.array_r, part.stiffness.duplicate()
    found.array[:] = -np.divide(1.0, rate, out=np.ones_like(rate), where=rate > 0)
    sizes = part.stiffness.getSizes()
    matrix = PETSc.Mat().createAIJ((sizes, sizes), nnz=(1, 0), comm=found.comm)
    matrix.setDiagonal(found)
    matrix.assemble()
    return matrix


class Direct:
    """The factorised matrix, as a preconditioner. Creation is collective.

    Args:
        form: of the system's matrix; where motions are free, their pins are always held.
        options: defaults of the factorisation's options.

    Attributes:
        matrix: what it preconditions: the matrix that is factorised, or the system's where that has pressures too.
        pc: the PC.
    """

    def __init__(self, form: FactorForm, options: Mapping[str, object]) -> None:
        self._system, matrix = form.system, form.matrix()
        self._factorisation = Factorisation(form, matrix, options)
        self._factorisation.allow_negative()
        self.matrix = form.system.jacobian.matrix if form.has_pressures else matrix
        self.pc = applied_by(self._factorisation, self.matrix) if form.has_pressures else self._factorisation.pc

    def prepare(self, held: Entities) -> None:
        """Take over the system's present matrix, hold these unknowns (local, owned, sorted), factorise. Collective."""
        self._factorisation.refresh()
        self._factorisation.factorise(np.union1d(held, self._system.pins))

    def free(self) -> None:
        """Free the PETSc objects."""
        self.pc.destroy()
        self._factorisation.free()

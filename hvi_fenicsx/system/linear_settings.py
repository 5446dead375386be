"""How linear systems are solved: a factorisation, algebraic or geometric multigrid, by size, levels and material."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from petsc4py import PETSc

from ..mesh import nodes
from .petsc_options import CHOLESKY, prefix
from .system import System
from .thresholds import DEFAULT, Thresholds

Kind = Literal["lu", "gamg", "mg", "mixed"]
_GAMG: dict[str, object] = {
    "pc_type": "gamg",
    "pc_gamg_threshold": 0.01,
    "mg_levels_ksp_type": "chebyshev",
    "mg_levels_pc_type": "jacobi",
    "pc_gamg_coarse_eq_limit": 200,
}
_MG: dict[str, object] = {
    "pc_type": "mg",
    "mg_levels_ksp_type": "richardson",
    "mg_levels_ksp_max_it": 1,
    "mg_levels_ksp_norm_type": "none",
    "mg_levels_pc_type": "sor",
    "mg_levels_pc_sor_local_symmetric": None,
    "mg_coarse_ksp_type": "preonly",
    "mg_coarse_pc_type": "bjacobi",
    "mg_coarse_sub_pc_type": "lu",
}
_EXACT = (PETSc.PC.Type.CHOLESKY, PETSc.PC.Type.LU, PETSc.PC.Type.PYTHON)
"""Types of a direct solver; the last is one of ours, which applies factors."""
_OF_OTHER_NORM = ("minres", "symmlq")
"""Methods that end by the norm of the preconditioned residual; PETSc refuses that of the residual itself."""


@dataclass(frozen=True, slots=True)
class LinearSettings:
    """How linear systems are solved.

    Attributes:
        kind: a factorisation (lu), algebraic multigrid (gamg), geometric multigrid (mg), or that with averaged
            pressures as unknowns (mixed).
        thresholds: when another kind takes over, and when a preconditioner is made anew.
        replaceable: whether the system is small enough for a direct solver to take over.
    """

    kind: Kind
    thresholds: Thresholds = DEFAULT
    replaceable: bool = False

    @classmethod
    def choose(
        cls,
        system: System,
        wanted: Literal["auto", "lu", "gamg"] = "auto",
        thresholds: Thresholds = DEFAULT,
        *,
        levels: bool = False,
    ) -> LinearSettings:
        """The solver that suits the number of unknowns, and nearly incompressible bodies.

        Args:
            system: the system to be solved.
            wanted: what the user wants.
            thresholds: up to which size a direct solver is used.
            levels: whether the system has coarser levels when it is solved.
        """
        small = system.dofs <= thresholds.largest_direct[system.problem.scales.dimension]
        if wanted != "auto":
            return cls(wanted, thresholds, small)
        stiff, degree = system.problem.bulk.volumetric_ratio, nodes.degree(system.problem.space)
        if levels and system.free_motions is None:
            if stiff <= thresholds.volumetric_ratio:
                return cls("mg", thresholds, small)
            if degree > 1:
                return cls("mixed", thresholds)
        if stiff > 0.0:
            return cls("lu", thresholds)
        return cls("lu" if small else "gamg", thresholds)

    def ksp(self, pc: PETSc.PC) -> dict[str, str]:
        """Default options of the Krylov method.

        Args:
            pc: the preconditioner; in the place of a factorisation the user may have chosen another one.
        """
        if self.kind == "lu" and pc.getType() in _EXACT:
            return {"ksp_type": "preonly"}
        # where a start is already a solution, PETSc's flexible CG (fcg) is freed without having been set up, and fails
        method = "fgmres" if self.kind == "mixed" else "cg"
        if PETSc.Options().getString(f"{prefix()}ksp_type", method) in _OF_OTHER_NORM:
            return {"ksp_type": method}
        return {"ksp_type": method, "ksp_norm_type": "unpreconditioned"}

    @property
    def iterations(self) -> int:
        """Iterations of the Krylov method at most."""
        if self.kind == "mixed":
            return self.thresholds.replaced_iterations
        return self.thresholds.replaced_iterations if self.replaceable else self.thresholds.krylov_iterations

    @property
    def pc(self) -> Mapping[str, object]:
        """Default options of the preconditioner."""
        return {"lu": CHOLESKY, "gamg": _GAMG, "mg": _MG, "mixed": _MG}[self.kind]

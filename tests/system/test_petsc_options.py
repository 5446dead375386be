"""An option that PETSc cannot use is told as the user's, with PETSc's reason."""

from __future__ import annotations

import pytest
from petsc4py import PETSc

from hvi_fenicsx import InputError
from hvi_fenicsx.system import petsc_options


def test_a_misspelt_type_is_told() -> None:
    petsc_options.insert("-hvi_pc_type luu")
    try:
        with pytest.raises(InputError, match=r"-hvi_pc_type luu: .*PC type luu"), petsc_options.refusals_told():
            petsc_options.configure(PETSc.PC().create(), {})
    finally:
        PETSc.Options().delValue("hvi_pc_type")


def test_an_error_that_no_option_can_have_made_stays() -> None:
    with pytest.raises(PETSc.Error), petsc_options.refusals_told():
        PETSc.PC().create().setType("luu")

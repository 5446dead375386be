"""An option that PETSc cannot use is told as the user's, with PETSc's reason."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from mpi4py import MPI
from petsc4py import PETSc
from runs import command, hvi, summary, write_scene
from scenes import model

from hvi_fenicsx import InputError
from hvi_fenicsx.system import petsc_options


def test_a_misspelt_type_is_told() -> None:
    petsc_options.insert("-hvi_pc_type luu")
    try:
        with pytest.raises(InputError, match=r"-hvi_pc_type luu: .*PC type luu"), petsc_options.refusals_told():
            petsc_options.configure(PETSc.PC().create(), {})
    finally:
        PETSc.Options().delValue("hvi_pc_type")


def test_options_and_prefix_hold_within_the_block_only() -> None:
    database, ksp = PETSc.Options(), PETSc.KSP().create(MPI.COMM_SELF)
    database.setValue("floor_ksp_max_it", 7)
    try:
        with petsc_options.chosen({"ksp_max_it": 9, "ksp_rtol": 0.5}, "floor_"):
            petsc_options.configure(ksp, {"ksp_rtol": 0.1, "ksp_atol": 0.2})
            petsc_options.check_read({"ksp_max_it": 9}, MPI.COMM_SELF)
            with pytest.raises(InputError, match="no solver of this run has read ksp_max_itt"):
                petsc_options.check_read({"ksp_max_itt": 9}, MPI.COMM_SELF)
        assert ksp.getTolerances() == (0.5, 0.2, ksp.getTolerances()[2], 9)
        assert database.getInt("floor_ksp_max_it") == 7
        assert not database.hasName("floor_ksp_rtol")
        assert petsc_options.prefix() == "hvi_"
    finally:
        database.delValue("floor_ksp_max_it")


@pytest.mark.parametrize(
    ("options", "prefix", "reason"),
    [
        ({"-ksp_max_it": 5}, "hvi_", "'-ksp_max_it' is no option"),
        ({"ksp_max_it": [5]}, "hvi_", r"ksp_max_it is \[5\]; give a number"),
        ("-ksp_max_it 5", "hvi_", "is no table of options"),
        ({}, "-floor_", "'-floor_' is no prefix of options"),
    ],
)
def test_what_is_no_option_is_refused(options: Any, prefix: str, reason: str) -> None:
    with pytest.raises(InputError, match=reason), petsc_options.chosen(options, prefix):
        pass


def test_options_that_nothing_has_read_are_told_with_the_prefix() -> None:
    petsc_options.insert("-ksp_type cg -hvi_ksp_max_it 7")
    try:
        petsc_options.configure(PETSc.KSP().create(MPI.COMM_SELF), {})
        told = list(petsc_options.unread("-ksp_type cg -hvi_ksp_max_it 7"))
        assert len(told) == 1
        assert "-ksp_type" in told[0]
        assert "-hvi_" in told[0]
    finally:
        for name in ("ksp_type", "hvi_ksp_max_it"):
            PETSc.Options().delValue(name)


def test_petscs_own_times_are_printed_where_they_are_asked_for() -> None:
    """PETSc asks for this option when it starts, and fails at its end where it comes later."""
    script = "from hvi_fenicsx.system import petsc_options; petsc_options.insert('-log_view')"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False, timeout=60)
    assert "PETSc Performance Summary" in done.stdout
    assert "ERROR" not in done.stderr


def test_algebraic_multigrid_by_options_solves_a_system_of_few_unknowns(tmp_path: Path) -> None:
    """Its coarsest mesh is the whole system."""
    file = write_scene(tmp_path / "square.toml", model(2))
    options = ["--petsc", "-hvi_ksp_type cg -hvi_pc_type gamg", "--no-pictures", "--out"]
    words = command("run", file, *options, tmp_path / "gamg")  # in a process of its own, which alone has the options
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")
    assert hvi("run", file, "--no-pictures", "--out", tmp_path / "lu").returncode == 0
    energies = [summary(tmp_path / name)["energy"] for name in ("gamg", "lu")]
    assert energies[0] == pytest.approx(energies[1], rel=1e-7)

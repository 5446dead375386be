"""An option that PETSc cannot use is told as the user's, with PETSc's reason."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
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

"""Mesh files that hold more than a mesh: programs, writing, endless loops. They are data, and can do no harm."""

from __future__ import annotations

import contextlib
import io
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from unittest import mock

import meshes
import numpy as np
import pytest
from mpi4py import MPI

from hvi_fenicsx import InputError
from hvi_fenicsx.errors import Interrupted
from hvi_fenicsx.mesh import gmsh_file
from hvi_fenicsx.mesh.domain import Domain
from hvi_fenicsx.mesh.domain import MeshThresholds as Thresholds
from hvi_fenicsx.runtime import cost, processes
from hvi_fenicsx.runtime.mpi import raise_second

TRIANGLE = """Point(1) = {0, 0, 0}; Point(2) = {1, 0, 0}; Point(3) = {0, 1, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 1};
Curve Loop(1) = {1, 2, 3}; Plane Surface(1) = {1};
Physical Curve("bottom") = {1}; Physical Curve("rest") = {2, 3}; Physical Surface("body") = {1};
"""
MARK = "HARM"
"""The name of the file that harm would leave."""


def written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def read(path: Path, seconds: float = 60.0) -> Domain:
    with mock.patch.object(gmsh_file, "DEFAULT", Thresholds(gmsh_seconds=seconds)):
        return gmsh_file.read(MPI.COMM_WORLD, path, 2)


def test_a_script_under_the_name_of_a_mesh_is_refused(tmp_path: Path) -> None:
    file = written(tmp_path / "m.msh", TRIANGLE + f'SystemCall "touch {tmp_path / MARK}";')
    with pytest.raises(InputError, match=r"does not begin with \$MeshFormat"):
        read(file)
    assert not (tmp_path / MARK).exists()


def test_options_beside_a_mesh_are_not_read(tmp_path: Path) -> None:
    file = meshes.make(tmp_path / "m.msh", meshes.GOOD)
    written(tmp_path / "m.msh.opt", f'Printf("x") > "{tmp_path / MARK}"; Exit;')
    assert set(read(file).sides) == {"left", "right", "bottom", "top"}
    assert not (tmp_path / MARK).exists()


HARMS = (
    'SystemCall "touch {0}"; System "rm {1}"; NonBlockingSystemCall "id > {0}"; OnelabRun("a", "touch {0}");',
    'Printf("x") > "{0}"; Printf("x") >> "{1}"; CreateDir "{0}"; Print "{0}"; Save "{0}"; Save "{1}";',
    'S2N[StrCat("System", "Call")] "touch {0}";',
    'Field[1] = ExternalProcess; Field[1].CommandLine = "touch {0}"; Background Field = 1;',
    'Include "other";',
    'Merge StrCat("oth", "er");',
    'Merge "{1}.gz";',
)
"""What scripts may hold; the first name is of a file that is not there, the second of one that must stay as it is."""


@pytest.mark.parametrize("commands", HARMS)
def test_a_script_can_do_no_harm(commands: str, tmp_path: Path) -> None:
    theirs, harm = written(tmp_path / "theirs", "precious"), tmp_path / MARK
    written(tmp_path / "theirs.gz", "precious")
    written(tmp_path / "other", f'SystemCall "touch {harm}"; Printf("x") > "{harm}";')
    written(tmp_path / "m.geo.opt", f'SystemCall "touch {harm}";')
    before = sorted(tmp_path.iterdir())
    with contextlib.suppress(InputError):
        read(written(tmp_path / "m.geo", TRIANGLE + commands.format(harm, theirs)))
    assert sorted(tmp_path.iterdir()) == sorted([*before, tmp_path / "m.geo"])
    assert theirs.read_text() == "precious"


def test_a_script_is_not_opened_where_the_system_cannot_confine_it(tmp_path: Path) -> None:
    file = written(tmp_path / "m.geo", TRIANGLE)
    words = [str(file), "script", "2", "4e3"]
    code = (
        "from hvi_fenicsx.mesh import gmsh_process\n"
        "gmsh_process.processes.confine = lambda memory: False\n"
        "gmsh_process.main()"
    )
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, check=True)
    with np.load(io.BytesIO(done.stdout)) as found:
        assert "this system cannot forbid it" in str(found["fault"])


LOOP = "For i In {1:1e12}\n a = i;\nEndFor\n"
ENDS = {
    "Exit;": ("ended gmsh", 60.0),
    "Exit 7;": ("exit code 7", 60.0),
    "Abort;": ("mesh file", 60.0),
    "For": ("gmsh cannot read it", 60.0),
    "Macro again\n Call again;\nReturn\nCall again;": ("mesh file", 3.0),
    LOOP: ("not done with it after 1 s", 1.0),
}


@pytest.mark.parametrize("command", ENDS)
def test_a_script_that_ends_gmsh_or_never_ends_is_refused(command: str, tmp_path: Path) -> None:
    words, seconds = ENDS[command]
    with pytest.raises(InputError, match=words) as refused:
        read(written(tmp_path / "m.geo", command + "\n" + TRIANGLE), seconds)
    assert str(tmp_path / "m.geo") in str(refused.value)


@pytest.mark.long
def test_a_script_that_fills_the_memory_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The machine's other programs lose nothing: gmsh gets a share of what is free, here 1.5 GB."""
    monkeypatch.setattr(cost, "free_memory", lambda: 1500.0 / 0.8)
    script = written(tmp_path / "m.geo", "a[] = {0:1000000000};\n" + TRIANGLE)
    with pytest.raises(InputError, match=r"wants more than the 1\.5 GB that it may use"):
        gmsh_file.read(MPI.COMM_WORLD, script, 2)


@pytest.mark.parametrize("count", ["1e8", "1e9"])
def test_a_count_of_too_many_cells_is_named_as_one(count: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Gmsh itself says nothing where an allocation fails."""
    monkeypatch.setattr(cost, "free_memory", lambda: 1000.0)
    script = written(tmp_path / "m.geo", TRIANGLE + f"Transfinite Curve {{1, 2}} = {count};")
    with pytest.raises(InputError, match=r"more than the 0\.78 GB that it may use; look for a count or a size"):
        read(script)


def signalled_while_meshing(temporary: Path) -> None:
    """A signal to this process a second after gmsh's own was given its folder."""
    while not list(temporary.iterdir()):
        time.sleep(0.01)
    time.sleep(1.0)
    os.kill(os.getpid(), signal.SIGUSR1)


def test_a_signal_ends_the_meshing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No temporary folder stays."""
    script, temporary = written(tmp_path / "m.geo", LOOP), tmp_path / "t"
    temporary.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    handler = signal.getsignal(signal.SIGUSR1)
    processes.catch([signal.SIGUSR1], raise_second)
    try:
        threading.Thread(target=signalled_while_meshing, args=(temporary,)).start()
        with pytest.raises(Interrupted):
            read(script)
    finally:
        signal.signal(signal.SIGUSR1, handler)
        processes.forget_signals()
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize("version", [2.2, 4.1])
def test_a_mesh_that_was_partitioned_is_read_as_a_whole(version: float, tmp_path: Path) -> None:
    saved = f'\nmesh.partition(2)\ngmsh.option.setNumber("Mesh.MshFileVersion", {version})'
    whole, parted = (meshes.make(tmp_path / f"{n}.msh", meshes.GOOD + text) for n, text in (("a", ""), ("b", saved)))
    found, wanted = read(parted), read(whole)
    assert {n: len(s) for n, s in found.sides.items()} == {n: len(s) for n, s in wanted.sides.items()}
    assert found.mesh.topology.index_map(2).size_local == wanted.mesh.topology.index_map(2).size_local


def test_an_element_in_two_groups_is_told(tmp_path: Path) -> None:
    twice = TRIANGLE.replace('"rest") = {2, 3}', '"rest") = {1, 2, 3}')
    with pytest.raises(InputError, match=r"nodes 1, \d is listed twice, or in two groups"):
        read(written(tmp_path / "twice.geo", f"{twice} Mesh.MeshSizeMax = 2;"))


def test_a_file_of_another_kind_is_told_how_to_convert(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"is no mesh: .*convert it by meshio"):
        read(written(tmp_path / "part.vtu", "<VTKFile>"))


@pytest.mark.parametrize(
    ("group", "said"),
    [("", "no physical group holds cells .*put every"), ('Physical Surface("body") = {7};', "body|no physical group")],
    ids=["forgotten", "renumbered"],
)
def test_a_group_of_cells_that_is_missing_is_told_so(group: str, said: str, tmp_path: Path) -> None:
    text = TRIANGLE.replace('Physical Surface("body") = {1};', group)
    with pytest.raises(InputError, match=said) as refused:
        read(written(tmp_path / "sides.geo", f"{text} Mesh.MeshSizeMax = 2;"))
    assert "lies on no cell" not in str(refused.value)

"""Environments and outputs: variables that are unset or odd, folders that are missing, streams that are closed."""

from __future__ import annotations

import random
from pathlib import Path

from .case import CHECK, OUT, RUN, Case, write

_BAD = "/proc/absent"
_VARIABLES: list[dict[str, str | None]] = [
    {"HOME": None}, {"HOME": "/nonexistent"}, {"HOME": ""}, {"HOME": "file"},
    {"TMPDIR": "/nonexistent"}, {"TMPDIR": "file"},
    {"TMPDIR": ""}, {"XDG_CACHE_HOME": "file"}, {"XDG_CACHE_HOME": _BAD},
    {"XDG_CACHE_HOME": ""}, {"XDG_CACHE_HOME": "a b\nc"},
    {"HOME": None, "XDG_CACHE_HOME": None, "TMPDIR": None}, {"XDG_CONFIG_HOME": "file"}, {"MPLCONFIGDIR": "file"},
    {"LANG": "C", "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}, {"LC_ALL": "xx_YY.broken"},
    {"PYTHONIOENCODING": "ascii"}, {"PYTHONIOENCODING": "utf-16"}, {"COLUMNS": "0"},
    {"COLUMNS": "-5"}, {"COLUMNS": "x"},
    {"COLUMNS": "1"}, {"TERM": ""}, {"TERM": "dumb"}, {"FORCE_COLOR": "1", "COLUMNS": "3"},
    {"NO_COLOR": "1"}, {"USER": None},
    {"OMP_NUM_THREADS": "x"}, {"PETSC_OPTIONS": "-options_left -absent 3"}, {"PETSC_OPTIONS": "-ksp_type absent"},
    {"PETSC_OPTIONS": "'"}, {"PETSC_OPTIONS": "-hvi_ksp_type absent"}, {"PYTHONWARNINGS": "error"}, {"TZ": "x/y"},
    {"PYTHONOPTIMIZE": "2"}, {"PYTHONUNBUFFERED": "1"}, {"PYTHONDEVMODE": "1"},
    {"MPLBACKEND": "absent"}, {"DISPLAY": ":99"},
    {"OMPI_COMM_WORLD_SIZE": "x"}, {"PMI_RANK": "3"}, {"SLURM_NTASKS": "4"}, {"CC": "absent"}, {"CFLAGS": "-nonsense"},
    {"SOURCE_DATE_EPOCH": "0"}, {"PATH": ""}, {"PATH": "/nonexistent"},
]  # fmt: skip
_SHELLS = [
    '"$@" | head -1', '"$@" | true', '"$@" 2>&1 | head -1', '"$@" >&-', '"$@" 2>&-', '"$@" <&-', '"$@" <&- >&- 2>&-',
    '"$@" > /dev/full', '"$@" 2> /dev/full', '"$@" > /dev/full 2>&1', "umask 777; \"$@\"",
    "umask 0; \"$@\"", 'ulimit -c 0; "$@"',
    'ulimit -n 24; "$@"', 'ulimit -f 8; "$@"', 'ulimit -f 0; "$@"', 'ulimit -v 3000000; "$@"', 'ulimit -t 60; "$@"',
    'ulimit -s 256; "$@"', 'ulimit -u 1; "$@"', 'nohup "$@" > log', 'setsid "$@"', "trap '' PIPE; \"$@\" | true",
    "trap '' INT TERM HUP; \"$@\"", 'yes | "$@"', 'exec 3>&1 4>&1 5<scene.toml; "$@"', 'nice -n 19 "$@"',
]  # fmt: skip
_PLANTED = ["typing.py", "json.py", "numpy.py", "gmsh.py", "sitecustomize.py", ".petscrc", "dolfinx_jit_options.json"]
_PLANTED += ["ffcx_options.json", "petscrc", "matplotlibrc", "pydantic/__init__.py", "pyproject.toml", "hvi_fenicsx.py"]

_MPI = ("ompi",)
"""Open MPI leaves empty folders of its own among temporary files, at every end."""


def variables(chance: random.Random, folder: Path) -> Case:
    """One set of variables that is odd."""
    write(folder)
    (folder / "file").write_text("precious")
    chosen = chance.choice(_VARIABLES)
    return Case(what=f"environment {chosen}", words=chance.choice([RUN, RUN, CHECK]), alone=True, environment=chosen)


def streams(chance: random.Random, folder: Path) -> Case:
    """Outputs that close, limits, signals that are ignored."""
    shell = chance.choice(_SHELLS)
    write(folder, None if "|" in shell or chance.random() < 0.8 else "boundary = 3")  # a pipe has its own exit code
    return Case(what=f"shell {shell}", words=chance.choice([RUN, RUN, CHECK]), alone=True, shell=shell, ours=("log",))


def planted(chance: random.Random, folder: Path) -> Case:
    """Files in the current folder that libraries might read or run."""
    write(folder)
    for name in chance.sample(_PLANTED, 4):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("open('HARM', 'w')\nraise SystemExit(77)\n")
    ranks = chance.choice([[], [], ["--np", "2"]])
    return Case(what=f"planted {ranks}", words=[*RUN, *ranks], alone=True)


def early_end(chance: random.Random, folder: Path) -> Case:
    """A signal a little after the start; nothing stays, not even among temporary files."""
    write(folder)
    (folder / "tmp").mkdir()
    words = ["run", "scene.toml", "--out", OUT, *chance.choice([[], ["--np", "2"]])]
    return Case(
        what="signal",
        words=words,
        alone=True,
        environment={"TMPDIR": str(folder / "tmp")},
        end_after=chance.uniform(0.2, 6.0),
        ours=_MPI,
    )


KINDS = [variables, variables, streams, streams, planted, early_end]

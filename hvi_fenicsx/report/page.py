"""``report.html`` beside a result: one file that a colleague reads without the program; and its pictures.

Both are made from the finished folder alone. A child process draws: what goes wrong in it (VTK aborts where it finds no
display) costs a picture, never a run. Nothing here imports a plotting library; the child does.

The templates in ``html/`` have the words; here is what they are given, and how numbers are written in them.
"""

from __future__ import annotations

import base64
import contextlib
import functools
import json
import os
import re
import shlex
import subprocess
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ExitCode
from ..runtime import manifest, processes, writing
from . import reader, units
from .reader import Result
from .solution_arrays import ContactPart, ReportError, ResultError
from .units import unless_noise

if TYPE_CHECKING:
    import jinja2

NAME = "report.html"
CAPTION = "Description"
"""The keyword of a picture's caption among its file's texts; it is one of the PNG standard's."""
MOST = 100
"""Equilibria in the table, those of lowest energy."""
_FIRST = ("escape", "scene", "body", "stress", "work_precision", "error_h", "error_epsilon", "time")
"""The pictures that are shown first, in this order; what is not named here comes after, by its name."""
_ABSOLUTE = re.compile(r"""(?P<before>^|=|=["'])/(?:[^/"']*/)*(?P<name>[^/"']*)""")
"""A path from the root as a word of a command line, or after an equals sign in it."""
UNFINISHED = ".png.part"
"""How the name of a picture ends that is being written."""
COMPLAINT = "pictures: "
"""How the child's message to its caller begins."""


def write(folder: Path) -> Path:
    """Write ``report.html`` into a result folder, from its files; for rank 0 alone.

    Raises:
        ResultError: no result is there, or its files are damaged.
        NotWrittenError: the page cannot be written.
    """
    result = reader.read(folder)
    kind, words = _headline(result)
    return _page(
        "run.html.j2",
        folder,
        result.title,
        result=result,
        verdict={"kind": kind, "words": words},
        contact=[{"name": part.name, "rows": list(contact_rows(part))} for part in result.parts],
        forces=_forces(result),
        reproduce=_reproduce(result),
    )


def write_path(folder: Path) -> Path:
    """Write the page of a finished load path, likewise.

    Raises:
        ResultError: no load path is there, or its files are damaged.
        NotWrittenError: the page cannot be written.
    """
    result = reader.read_path(folder)
    peaks = result.path["peak_forces"]
    largest = max((abs(f) for found in peaks.values() for f in found["force"]), default=0.0)
    forces = {
        part: {**found, "force": [unless_noise(f, largest) for f in found["force"]]} for part, found in peaks.items()
    }
    return _page("path.html.j2", folder, result.title, result=result, forces=forces)


def write_equilibria(folder: Path) -> Path:
    """Write the page of a search of all equilibria, likewise.

    Raises:
        ResultError: no search is there, or its files are damaged.
        NotWrittenError: the page cannot be written.
    """
    result = reader.read_equilibria(folder)
    return _page("equilibria.html.j2", folder, result.title, result=result, most=MOST)


def write_study(folder: Path) -> Path:
    """Write the page of a finished study; for one process alone.

    Raises:
        ResultError: no study is there, or it is damaged.
        NotWrittenError: the page cannot be written.
    """
    file = folder / "study.json"
    try:
        study = json.loads(file.read_text(encoding="utf-8"))
        given = {key: study[key] for key in ("sentences", "points", "ranks", "version", "quantities")}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ResultError(f"{file}: no finished study, or damaged ({error})") from None
    return _page("study.html.j2", folder, f"{study['scene'] or 'untitled'}: what accuracy costs", **given)


def _page(template: str, folder: Path, title: str, **given: Any) -> Path:
    """Write the page of a folder, and list it among the folder's files."""
    words = _environment().get_template(template).render(title=title, pictures=_pictures(folder), **given)
    writing.text(folder / NAME, words)
    manifest.add(folder, [NAME])
    return folder / NAME


@functools.cache
def _environment() -> jinja2.Environment:
    """The templates, each compiled once, with the ways in which they write numbers."""
    import jinja2  # a tenth of a second, for the report alone

    loader = jinja2.FileSystemLoader(Path(__file__).with_name("html"))
    found = jinja2.Environment(
        loader=loader, autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    ways: list[Callable[..., str]] = [units.number, units.quantity, units.thousands, said, two_digits]
    found.filters |= {way.__name__: way for way in ways}
    found.filters |= {"file_name": lambda path: PurePath(str(path)).name, "named": _named}
    return found


def two_digits(value: float | None) -> str:
    """A number that is read for its size alone.

    Args:
        value: the number; None where it is not finite.
    """
    return "not finite" if value is None else units.number(float(f"{value:.1e}"))


def said(value: Any) -> str:
    """A value of a scene file as people write it.

    Args:
        value: the value.
    """
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return units.number(value)
    if isinstance(value, list):
        return f"({', '.join(map(said, value))})"
    if isinstance(value, Mapping):
        texts = {key: f"({said(item)})" if isinstance(item, Mapping) else said(item) for key, item in value.items()}
        return ", ".join(text if key == "law" else f"{key} {text}" for key, text in texts.items())
    return str(value).replace("_", " ") if str(value).isidentifier() else str(value)


def _named(table: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    """``[material]`` itself, or each ``[material.NAME]``."""
    tables = [(f" “{name}”", t) for name, t in table.items() if isinstance(t, Mapping) and "law" not in t]
    return tables if len(tables) == len(table) else [("", table)]


def _pictures(folder: Path) -> dict[str, dict[str, Any]]:
    """The finished pictures of a folder, which lie in the page itself, each with its size: the page does not jump."""
    found = folder.glob("[!.]*.png")
    ordered = sorted(found, key=lambda p: (_FIRST.index(p.stem) if p.stem in _FIRST else len(_FIRST), p.stem))
    return {path.stem: _picture(path) for path in ordered}


def _picture(path: Path) -> dict[str, Any]:
    from PIL import Image

    with Image.open(path) as image:
        (width, height), caption = image.size, image.info.get(CAPTION) or path.stem
    data = f"data:image/png;base64,{base64.b64encode(path.read_bytes()).decode()}"
    return {"caption": caption, "data": data, "width": width, "height": height}


def _headline(result: Result) -> tuple[str, str]:
    """Whether the answer is good news (``good``, ``limited`` or ``bad``), and the answer in one line."""
    code, state = result.summary.get("exit_code"), result.solvability.get("state")
    if result.certified and result.coarse:
        rough = "its numbers are rough; refine the mesh, or ask `hvi run` for an --accuracy"
        return "limited", f"Certified on a coarse mesh: the estimated error is large, so {rough}."
    if result.certified and state == "held":
        return "good", "A solution exists, was found, and is certified."
    if result.certified:
        return "limited", f"An equilibrium was found and is certified; the state is {state}."
    if not result.solved:
        return "bad", "No solution exists: the load carries the body away."
    if code == ExitCode.INTERRUPTED:
        return "bad", "The run was interrupted: what is shown is not a solution."
    off = " The body is carried off; `hvi path` finds the last state that is borne." if result.carried_off else ""
    return "bad", f"No certified solution: {result.summary.get('reason')}.{off}"


def contact_rows(part: ContactPart) -> Iterator[tuple[str, str]]:
    """What happened on a part of Γc, in words and numbers.

    Args:
        part: the part.
    """
    yield "vertices", units.thousands(len(part))
    if part.has("contact"):
        yield "in contact", units.thousands(int(np.nansum(part["contact"])))
        yield "largest gap", _largest(part["gap"], "m")
    yield "largest slip", _largest(np.abs(part.size("slip")), "m")
    if part.has("branch_t"):
        yield "largest friction", _largest(np.abs(part.size("friction")), "Pa")
        yield "pieces of the friction law in use, from 0", _pieces(part["branch_t"])
    yield "largest pressure", _largest(part.pressure, "Pa")
    if part.has("branch_n"):
        yield "largest tension", _largest(part["sigma_n"], "Pa")
        yield "pieces of the normal law in use, from 0", _pieces(part["branch_n"])


def _largest(values: Any, unit: str) -> str:
    known = values[np.isfinite(values)]
    return units.quantity(max(float(known.max()), 0.0), unit) if len(known) else "-"


def _pieces(branch: Any) -> str:
    """How many vertices are on which piece of the law's graph, counted from 0 as in ``contact.csv``."""
    found, counts = np.unique(branch[np.isfinite(branch)].astype(int), return_counts=True)
    names = ("on a kink" if piece < 0 else f"on piece {piece}" for piece in found)
    return ", ".join(f"{units.thousands(int(n))} {name}" for name, n in zip(names, counts, strict=True))


def _forces(result: Result) -> dict[str, Any] | None:
    """The forces on the body by place and in all, by component; None where the summary has none."""
    found: Mapping[str, list[float]] = result.summary.get("resultants") or {}
    if not found:
        return None
    places = {**found, "in all": [sum(component) for component in zip(*found.values(), strict=True)]}
    dimension, largest = len(places["in all"]), max(abs(v) for force in places.values() for v in force)
    unit = units.unit_for(largest, "N" if dimension == 3 else "N/m")
    rows = {name: [unit.number(unless_noise(v, largest)) for v in force] for name, force in places.items()}
    return {"axes": [f"{axis}, {unit.name}" for axis in "xyz"[:dimension]], "rows": rows}


def _reproduce(result: Result) -> dict[str, Any]:
    """The command that gave the result, the one that gives it again, the scene, and the files that this names.

    Files are said by their names alone, since a reader has other folders.
    """
    summary, text = result.summary, (result.folder / "scene.toml").read_text(encoding="utf-8")
    mesh = (result.scene.get("domain") or {}).get("file")
    files = [str(file) for file in (mesh, *(result.scene.get("plugins") or ())) if file]
    for file in files:
        text = text.replace(f'"{file}"', f'"{PurePath(file).name}"')
    ranks, petsc = int(summary.get("ranks") or 1), str(summary.get("petsc") or "")
    again = ["hvi", "run", "scene.toml", "--out", "again"]
    again += ["--np", str(ranks)] if ranks > 1 else []
    again += [f"--petsc={petsc}"] if petsc else []
    given = shlex.split(str(summary.get("command") or ""))
    return {
        "given": shlex.join(_ABSOLUTE.sub(r"\g<before>\g<name>", word) for word in given),
        "can": summary.get("command") is not None,
        "again": shlex.join(again),
        "scene": text,
        "download": f"data:application/toml;base64,{base64.b64encode(text.encode()).decode()}",
        "files": [PurePath(file).name for file in files],
    }


class PictureError(ReportError):
    """A picture could not be drawn; those that could are in the folder."""


@dataclass(frozen=True)
class PictureProcess:
    """A process that draws a folder's pictures; what it needs for that it loads before it is told to.

    Attributes:
        folder: whose pictures it draws.
        command: by which they can be drawn again.
        child: the process; where there is none, why.
    """

    folder: Path
    command: list[str]
    child: subprocess.Popen[str] | str

    def begin(self) -> None:
        """Let it draw: the folder has all that pictures are drawn from."""
        if isinstance(self.child, subprocess.Popen) and self.child.stdin:
            with contextlib.suppress(OSError):  # it has failed already: then `finish` tells
                self.child.stdin.write("draw\n")
                self.child.stdin.flush()

    def finish(self, timeout: float = 120) -> list[Path]:
        """Wait for the pictures; they are listed in the folder.

        Args:
            timeout: seconds after which the process is given up.

        Returns:
            The pictures, as paths.

        Raises:
            PictureError: the process failed; its message says which picture and why.
            NotWrittenError: there is no room for a picture.
        """
        if isinstance(self.child, str):
            raise PictureError(f"no process draws: {self.child}")
        try:
            names, errors = self.child.communicate(timeout=timeout)
        except subprocess.TimeoutExpired:
            raise PictureError(f"not drawn within {timeout:g} s; {shlex.join(self.command)} tries again") from None
        writing.raise_handed_over(self.child.returncode, errors)
        if self.child.returncode != 0:
            raise PictureError(_message(errors, self.child.returncode))
        manifest.add(self.folder, names.splitlines())
        return [self.folder / name for name in names.splitlines()]


def draw(folder: Path, *, timeout: float = 120) -> list[Path]:
    """Draw all pictures of a finished folder; for rank 0 alone.

    Args:
        folder: a finished result.
        timeout: as for :meth:`PictureProcess.finish`, which tells the errors too.
    """
    with picture_process(folder) as process:
        process.begin()
        return process.finish(timeout)


@contextlib.contextmanager
def picture_process(folder: Path) -> Iterator[PictureProcess]:
    """What will draw; whatever happens, of it nothing remains: no process (it leads a group), no half-written file.

    Args:
        folder: a result that will be finished; for rank 0 alone.
    """
    # One thread for linear algebra: the child forks, and what it draws needs none.
    alone, pipe = {**processes.environment(), "OMP_NUM_THREADS": "1"}, subprocess.PIPE
    command = [*processes.PYTHON, "-m", f"{__package__}.pictures.drawings", os.path.abspath(folder)]
    child: subprocess.Popen[str] | str
    try:  # in the result's folder: in the current one matplotlib would read a file of settings
        child = subprocess.Popen(
            [*command, "--when-told"], env=alone, cwd=folder, start_new_session=True, stdin=pipe, stdout=pipe,
            stderr=pipe, text=True,
        )  # fmt: skip
    except OSError as error:
        child = error.strerror or str(error)
    try:
        yield PictureProcess(Path(folder), command, child)
    finally:
        if isinstance(child, subprocess.Popen) and child.returncode != 0:
            processes.end(child)
            for file in Path(folder).glob(f".*{UNFINISHED}"):
                file.unlink(missing_ok=True)


def _message(errors: str, code: int) -> str:
    """The child's own words are the lines that begin so; before them there may be a library's noise."""
    own = [line.removeprefix(COMPLAINT) for line in errors.splitlines() if line.startswith(COMPLAINT)]
    noise = errors.strip().splitlines()[-1:]
    return "; ".join(own or [f"the drawing process ended with {code}", *noise])

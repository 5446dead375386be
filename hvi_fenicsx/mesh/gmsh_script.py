"""Whether a gmsh script holds commands that run programs or write files: they are refused by name, with their line.

This is for the message. What a script may do is enforced by :mod:`.gmsh_reader`.
"""

from __future__ import annotations

import re
from pathlib import Path

from ..errors import InputError

_TOKEN = re.compile(r"""//[^\n]*|/\*.*?(?:\*/|\Z)|"[^"]*"|'[^']*'|[A-Za-z_]\w*|>>|\S""", re.DOTALL)
_LONGEST = 1000
"""Words that are looked at behind one, as for the end of an argument list."""
_RUNS = ("SystemCall", "System", "NonBlockingSystemCall", "OnelabRun")
_WRITES = ("Save", "Print", "CreateDir")
_READS = ("Include", "Merge", "MergeWithBoundingBox")
_STARTS = ("ExternalProcess",)
"""A kind of field."""
_HIDES = ("S2N", "StringToName")
"""They make a name, that of a command too, of any text."""
_DATA = (
    *(".stl", ".brep", ".brp", ".rle", ".xao", ".iges", ".igs", ".step", ".stp", ".sat", ".x_t", ".xmt_txt"),
    *(".x_b", ".xmt_bin", ".unv", ".vtk", ".mesh", ".off", ".obj", ".diff", ".med", ".bdf", ".nas", ".neu", ".dat"),
    *(".p3d", ".ply", ".ply2", ".cgns", ".nii"),
)
"""Names of files that gmsh merges as data, whatever they hold."""
_PROGRAMS = (".gz", ".py", ".m", ".exe", ".pro")
"""Names of files for which it starts a program."""
_MESH = (b"$MeshFormat", b"$Comments", b"$PostFormat", b"$View", b"$NO", b"$PTS", b"$PARA", b"$ELM")
"""Beginnings of other files that it merges as data; all the rest it reads as scripts."""


def check(path: Path) -> None:
    """Refuse a script that runs programs or writes files, itself or by another that it includes.

    Args:
        path: of the script.

    Raises:
        InputError: with the file, the line and the command.
        OSError: a file cannot be read.
    """
    _check(path, set())


def _check(path: Path, seen: set[Path]) -> None:
    """Check a script, those that it includes, and that of options beside it, which gmsh reads by itself."""
    if path in seen or not path.is_file():
        return  # gmsh itself refuses what is not there
    seen.add(path)
    text = path.read_bytes().decode("latin-1")
    if "\0" in text:
        raise InputError(f"mesh file {path}: is no text")
    tokens = [(found[0], found.start()) for found in _TOKEN.finditer(text) if found[0][:2] not in ("//", "/*")]
    words = [word for word, _ in tokens]
    for i, (word, start) in enumerate(tokens):
        if fault := _fault(word, words[i + 1 : i + _LONGEST]):
            raise InputError(f"mesh file {path}:{_line(text, start)}: {word} {fault}")
        if word in _READS and _is_text(words[i + 1 : i + 2]):
            named = path.parent / words[i + 1][1:-1]
            if named.exists() and not named.is_file():  # a device may have no end
                raise InputError(f"mesh file {path}:{_line(text, start)}: {word} wants a file, and {named} is none")
            _check_named(named, word, seen)
    _check(path.with_name(path.name + ".opt"), seen)


def _line(text: str, start: int) -> int:
    return text.count("\n", 0, start) + 1


def _check_named(path: Path, word: str, seen: set[Path]) -> None:
    """Check a file that is included or merged, where gmsh would read it as a script."""
    if word != "Include" and path.suffix.lower() in _PROGRAMS:
        raise InputError(f"mesh file {path}: cannot be merged into a mesh: gmsh would start a program for it")
    if word == "Include" or not (path.suffix.lower() in _DATA or _begins_as_data(path)):
        _check(path, seen)


def _begins_as_data(path: Path) -> bool:
    return path.is_file() and path.open("rb").readline().startswith(_MESH)


def _fault(word: str, rest: list[str]) -> str:
    """What is wrong with a word and those behind it; nothing for most."""
    is_command = _is_text(rest) or (rest and re.match(r"[A-Za-z_]", rest[0]))
    if word in _HIDES:
        return "makes names of texts, those of commands too, which a mesh file may not; write the name itself"
    if word in _STARTS or (word in _RUNS and (is_command or rest[:1] == ["("])):
        return "runs a program, which a mesh file may not; remove it"
    if (word in _WRITES and is_command) or (word == "Printf" and _goes_to_file(rest)):
        return "writes a file, which a mesh file may not; remove it"
    if word in _READS and is_command and not _is_text(rest):
        return "wants the name of a file in quotes, no expression"
    return ""


def _is_text(words: list[str]) -> bool:
    return bool(words) and words[0][0] in "\"'"


def _goes_to_file(words: list[str]) -> bool:
    """Whether what follows ``Printf``, an argument list, is followed by > or >>."""
    depth = 0
    for i, word in enumerate(words):
        depth += (word == "(") - (word == ")")
        if depth == 0:
            return words[i + 1 : i + 2] in ([">"], [">>"])
    return True  # a list without an end

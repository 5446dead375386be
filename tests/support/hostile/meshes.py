"""Mesh files: versions, binary ones, headers, counts, coordinates, groups, and scripts that do what scripts can do."""

from __future__ import annotations

import os
import random
import re
from pathlib import Path

import meshes as good
from scenes import model, quadratic_linear

from .case import CHECK, RUN, Case, write

_VERSIONS = [("2.2", 0), ("2.2", 1), ("4.0", 0), ("4.1", 0), ("4.1", 1), ("1", 0), ("2.2 parted", 0), ("4.1 parted", 0)]
_SECTIONS = [b"Nodes", b"Elements", b"Entities", b"PhysicalNames", b"MeshFormat"]
_NUMBERS = [
    b"nan",
    b"-nan",
    b"inf",
    b"1e308",
    b"-1e308",
    b"1e-320",
    b"0x1p3",
    b"1,5",
    b"1d5",
    b"",
    b"--1",
    b"1e999",
    b"7e0",
]
_COUNTS = [
    b"0",
    b"-1",
    b"1",
    b"7",
    b"999999999",
    b"2147483648",
    b"4294967297",
    b"9223372036854775807",
    b"1e3",
    b"x",
    b"",
]
_HEADERS = [
    b"9.9 0 8",
    b"-1 0 8",
    b"4.1 1 8",
    b"2.2 1 8",
    b"4.1 0 4",
    b"4.1 0 8 7",
    b"",
    b"4.1",
    b"nan 0 8",
    b"2.2 0 0",
]
_GROUPS = [
    b"",
    b" ",
    b"a b",
    b"bottom",
    b"\x1b[2J",
    b"a\0b",
    b"\xe9",
    b"\xf0\x9f\x98\x80",
    b"x" * 5000,
    b"..",
    b"$EndNodes",
]
_TAGS = [b"0", b"-5", b"2147483647", b"2147483648", b"18446744073709551615", b"1000000000"]


def _base(chance: random.Random, folder: Path) -> bytes:
    version, binary = chance.choice(_VERSIONS)
    parted = "\nmesh.partition(2)" if "parted" in version else ""
    options = f'gmsh.option.setNumber("Mesh.MshFileVersion", {version.split()[0]})\n'
    options += f'gmsh.option.setNumber("Mesh.Binary", {binary})\n'
    return good.make(folder / "m.msh", options + good.GOOD.replace("0.2", "0.45") + parted).read_bytes()


def _section(raw: bytes, name: bytes) -> tuple[int, int]:
    """Where the content of a section begins and ends; nothing at the end where there is none."""
    begin, end = raw.find(b"$" + name + b"\n"), raw.find(b"$End" + name)
    return (begin + len(name) + 2, end) if 0 <= begin < end else (len(raw), len(raw))


def _word(chance: random.Random, raw: bytes, section: bytes, new: list[bytes], *, first: bool = False) -> bytes:
    """A number of a section, perhaps of its first line, something else."""
    begin, end = _section(raw, section)
    if first:
        end = raw.find(b"\n", begin)
    words = list(re.finditer(rb"[0-9.e+-]+", raw[begin:end]))
    if not words:
        return raw
    found = chance.choice(words)
    return raw[: begin + found.start()] + chance.choice(new) + raw[begin + found.end() :]


def _truncated(chance: random.Random, raw: bytes) -> bytes:
    return raw[: chance.randrange(len(raw))]


def _flipped(chance: random.Random, raw: bytes) -> bytes:
    found = bytearray(raw)
    for _ in range(chance.choice([1, 3, 30])):
        found[chance.randrange(len(b"$MeshFormat\n"), len(found))] ^= 1 << chance.randrange(8)
    return bytes(found)


def _count(chance: random.Random, raw: bytes) -> bytes:
    return _word(chance, raw, chance.choice(_SECTIONS[:4]), _COUNTS, first=True)


def _coordinate(chance: random.Random, raw: bytes) -> bytes:
    return _word(chance, raw, b"Nodes", _NUMBERS)


def _tag(chance: random.Random, raw: bytes) -> bytes:
    return _word(chance, raw, chance.choice([b"Elements", b"Entities", b"PhysicalNames", b"Nodes"]), _TAGS)


def _header(chance: random.Random, raw: bytes) -> bytes:
    begin, end = _section(raw, b"MeshFormat")
    ways = [raw[:begin] + chance.choice(_HEADERS) + b"\n" + raw[end:], b"\xef\xbb\xbf" + raw, b"\n" + raw, b" " + raw]
    ways += [
        raw.replace(b"\n", b"\r\n"),
        raw.replace(b"\n", b"\r"),
        raw[:begin] + raw,
        b"$MeshFormat\n",
        b"$MeshFormat",
    ]
    return chance.choice(ways)


def _group(chance: random.Random, raw: bytes) -> bytes:
    old = chance.choice([b'"left"', b'"bottom"', b'"body"', b'"top"'])
    return raw.replace(old, b'"' + chance.choice(_GROUPS) + b'"', 1)


def _sections(chance: random.Random, raw: bytes) -> bytes:
    """One goes, comes twice or at another place; or what no version knows comes."""
    name = chance.choice(_SECTIONS[:4])
    begin, end = _section(raw, name)
    start, stop = begin - len(name) - 2, end + len(name) + 5
    piece, rest = raw[start:stop], raw[:start] + raw[stop:]
    return chance.choice([rest, raw + piece, rest + piece, raw + b"$Odd\n" + b"1 " * 9999 + b"\n$EndOdd\n", raw + raw])


_DAMAGES = [_truncated, _flipped, _count, _coordinate, _tag, _header, _group, _sections]


def _scene(file: str, **more: object) -> dict[str, object]:
    return model(2, friction=quadratic_linear(1e3)) | {"domain": {"shape": "file", "file": file, **more}}


def damaged_mesh(chance: random.Random, folder: Path) -> Case:
    """One or two damages of a mesh file of some version."""
    raw, done = _base(chance, folder), chance.sample(_DAMAGES, chance.choice([1, 1, 2]))
    for damage in done:
        raw = damage(chance, raw) if raw else raw
    (folder / "m.msh").write_bytes(raw)
    if chance.random() < 0.3:
        (folder / "m.msh.opt").write_text('SystemCall "touch HARM"; Exit;')
    write(folder, _scene("m.msh"))
    words = chance.choice([CHECK, RUN])
    return Case(what=", ".join(d.__name__ for d in done), words=words)


_SQUARE = """SetFactory("OpenCASCADE"); Rectangle(1) = {0, 0, 0, 1, 1}; Mesh.MeshSizeMax = 0.45;
Physical Curve("bottom") = {1}; Physical Curve("right") = {2}; Physical Curve("top") = {3};
Physical Curve("left") = {4}; Physical Surface("body") = {1};
"""
_BEFORE = [
    "Exit;",
    "Exit 7;",
    "Abort;",
    "For",
    "Macro a\n Call a;\nReturn\nCall a;",
    'Error("%s%n");',
    "If (1)",
    "EndIf",
]
_BEFORE += [
    'Include "m.geo";',
    'Merge "m.geo";',
    'Merge "absent.msh";',
    'Merge "/dev/zero";',
    'Include "/etc/shadow";',
    "\0",
]
_BEFORE += [
    "S" + 'ystemCall "touch HARM";',
    'Printf("x") > "HARM";',
    'Save "HARM";',
    "}" * 5000,
    "a = " + "(" * 9999,
    "\x1b[2J",
]
_AFTER = [
    "Mesh.MeshSizeMax = 1e-300;",
    "Mesh.MeshSizeMax = -1;",
    "Mesh.Algorithm = 99;",
    "Mesh.ElementOrder = 3;",
    "Mesh 3;",
]
_AFTER += [
    "Mesh.MeshSizeMax = 0.45; Recombine Surface{1};",
    "Delete All;",
    "General.NumThreads = -1;",
    "Delete Physicals;",
]
_AFTER += ['Physical Curve("bottom") += {99};', 'Physical Curve("a\nb") = {-1};', "Dilate{{0,0,0}, 0}{Surface{1};}"]
_AFTER += [
    "Dilate{{0,0,0}, 1e300}{Surface{1};}",
    "Geometry.Tolerance = 1e9;",
    "Mesh 2; Mesh 2; RefineMesh;",
    "Rectangle(1) = {0,0,0,1,1};",
]
_AFTER += [
    "Physical Surface('\x1b[31m') = {1};",
    "Mesh.SaveAll = 1;",
    "Rotate{{1,0,0},{0,0,0},1}{Surface{1};}",
    "Mesh 2; Exit;",
]
_AFTER += [
    "Symmetry{1,0,0,0}{Duplicata{Surface{1};}}",
    'Physical Curve("left") = {1};',
    "General.Verbosity = 99;",
    "Mesh 1;",
]


def script(chance: random.Random, folder: Path) -> Case:
    """A ``.geo`` with a command before or after the geometry."""
    early = chance.random() < 0.5
    command = chance.choice(_BEFORE if early else _AFTER)
    (folder / "m.geo").write_text(f"{command}\n{_SQUARE}" if early else _SQUARE + command)
    write(folder, _scene("m.geo"))
    return Case(what=f"geo: {command[:40]!r}", words=CHECK)


def endless_script(chance: random.Random, folder: Path) -> Case:
    """A ``.geo`` that never ends, or takes all memory; a signal ends it."""
    (folder / "tmp").mkdir()
    loops = ["For i In {1:1e12}\n a = i;\nEndFor\n", "l() = {};\nFor i In {1:1e12}\n l() += {i};\nEndFor\n"]
    (folder / "m.geo").write_text(chance.choice(loops) + _SQUARE)
    write(folder, _scene("m.geo"))
    return Case(
        what="endless script",
        words=chance.choice([CHECK, RUN]),
        alone=True,
        environment={"TMPDIR": str(folder / "tmp")},
        end_after=8.0,
        ours=("ompi",),
    )


def odd_mesh_file(chance: random.Random, folder: Path) -> Case:
    """A mesh file that is something else, or named by an odd path or scale."""
    file, more = "m.msh", {}
    kind = chance.choice(["folder", "zero", "fifo", "loop", "empty", "scale", "suffix", "path", "picture"])
    raw = _base(chance, folder)
    path = folder / file
    if kind in ("scale", "suffix", "path"):
        more = {"scale": chance.choice([5e-324, 1e308, 1e-160, 1e160, -1, 0, 1e30])} if kind == "scale" else {}
        file = {
            "suffix": chance.choice(["m.stl", "m", "m.MSH", "m.msh.gz", "m.py"]),
            "path": "./a/../" * 50 + file,
        }.get(kind, file)
        if kind == "suffix":
            (folder / file).write_bytes(raw)
    else:
        path.unlink()
        ways = {
            "folder": path.mkdir,
            "zero": lambda: path.symlink_to("/dev/zero"),
            "loop": lambda: path.symlink_to(path),
        }
        ways |= {"empty": path.touch, "fifo": lambda: os.mkfifo(path)}
        ways.get(kind, lambda: path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(range(256))))()
    write(folder, _scene(file, **more))
    return Case(what=f"mesh file: {kind}", words=CHECK)


KINDS = [damaged_mesh, damaged_mesh, script, endless_script, odd_mesh_file, damaged_mesh]

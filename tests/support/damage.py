"""Damaged scenes and meshes, drawn at random: what users, editors and full disks do to files."""

from __future__ import annotations

import contextlib
import copy
import os
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import tomli_w
from scenes import Table, block, model, quadratic_linear

GLUE = {"law": "graph", "points": [[0, 0], [4e-6, 5e6], [20e-6, 0]], "one_sided": True}
_3D = {"model": "three_dimensional", "youngs_modulus": 3.0e10, "poisson_ratio": 0.2}


def _bases() -> list[Table]:
    slot = model(3)
    slot["boundary"]["floor"] = {"on": "bottom", "contact": {"lower": -1e-6, "upper": 2e-6}}
    glued = model(3, press=-1e5)
    glued["boundary"]["floor"]["adhesion"] = dict(GLUE)
    warm = model(3) | {"body": {"temperature": 60.0, "force": [0.0, "-1e4*x"]}}
    warm["material"] |= {"thermal_expansion": 1.2e-5}
    solid = {
        "domain": {"shape": "box", "size": [1.0, 1.0, 1.0], "cells": [2, 2, 2]},
        "material": dict(_3D),
        "body": {"force": [0.0, 1.0e4, -2.5e4]},
        "boundary": {
            "wall": {
                "on": "left",
                "contact": {"lower": 0.0, "upper": 0.0},
                "friction": quadratic_linear(4e4, 1e-4),
            }
        },
    }
    smooth = model(4, 3e6, friction=quadratic_linear(1e6), smoothing="quadratic", epsilon=0.01)
    return [model(4, friction=quadratic_linear(1e3)), block(3, 4e5, friction=quadratic_linear(1e6)), smooth] + [
        *(slot, glued, warm, solid)
    ]


Path_ = tuple[str | int, ...]


def leaves(value: Any, at: Path_ = ()) -> Iterator[Path_]:
    """The places of all numbers and words."""
    entries = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    if not isinstance(value, dict | list):
        yield at
    for key, entry in entries:
        yield from leaves(entry, (*at, key))


def inner(value: Any, at: Path_ = ()) -> Iterator[Path_]:
    """The places of all entries of tables, tables among them."""
    if isinstance(value, dict):
        for key, entry in value.items():
            yield (*at, key)
            yield from inner(entry, (*at, key))


def get(table: Any, at: Path_) -> Any:
    """The entry at a place."""
    for step in at:
        table = table[step]
    return table


def put(table: Any, at: Path_, value: Any) -> None:
    """Replace the entry at a place."""
    get(table, at[:-1])[at[-1]] = value


_HUGE = 10**40
_VALUES = [
    float("nan"),
    float("inf"),
    -1,
    0,
    _HUGE,
    1e308,
    1e-308,
    -0.0,
    True,
    "",
    "x",
    [],
    {},
    [[1]],
    "1/0",
    "left",
    7,
]
_FORMULAS = ["1/x", "1/(x - 0.5)", "log(x - 0.5)", "sqrt(-1 - x)", "1e308*1e10*x", "0/0", "x**-1", "exp(1e4*x)", "nan"]
_FORMULAS += ["inf", "x.y", "x(y)", "z", "1e400", "x if x else y", "x" * 500, "(" * 200 + "x" + ")" * 200, "9**9**9*x"]
_SIDES = ["left", "right", "bottom", "top", "front", "Left", "", ["left", "right"], ["left", "left"], [], 3]
_BACKWARDS = {"law": "graph", "points": [[1, 0], [0, 1]]}
_EFFECTS = [
    {"displacement": [0.0, 0.0]}, {"displacement": ["free", 1e-3]}, {"traction": [1e6, 1e6]},
    {"contact": {"gap": -1e-6}},
    {"contact": {"lower": 1e-6, "upper": -1e-6}}, {"friction": quadratic_linear(1e6)}, {"adhesion": dict(GLUE)},
    {"support": {"law": "graph", "points": [[0, 0], [0, 1e6]]}}, {"friction": dict(_BACKWARDS)},
    {"contact": {"obstacle": {"point": [0, 0], "normal": [0, 1]}}}, {},
]  # fmt: skip
_SOLVER = {
    "method": ["auto", "snes_vi", "branch", "condensed", "newton"],
    "smoothing": ["quadratic", "paper", "chks", "log_exp", "none"],
    "epsilon": [1e-300, 1e-12, 1e6, 1e300, 0],
    "epsilon_absolute": [1e-300, 0.1, 1e300],
    "tolerance": [1e-300, 1e-16, 0.9, 2.0, 1e300],
    "max_iterations": [0, 1, 10**12],
}


def wrong_type(chance: random.Random, table: Table) -> None:
    put(table, chance.choice([*leaves(table), *inner(table)]), copy.deepcopy(chance.choice(_VALUES)))


def misspelt(chance: random.Random, table: Table) -> None:
    at = chance.choice(list(inner(table)))
    word, holder = str(at[-1]), get(table, at[:-1])
    i = chance.randrange(len(word))
    holder[chance.choice([word[:i] + word[i + 1 :], word[:i] + word[i] + word[i:], word.upper()])] = holder.pop(word)


def other_units(chance: random.Random, table: Table) -> None:
    for _ in range(chance.choice([1, 1, 2])):
        at = chance.choice([p for p in leaves(table) if type(get(table, p)) is float])
        put(table, at, get(table, at) * 10.0 ** (chance.choice([-1, 1]) * chance.uniform(6, 12)))


def swapped(chance: random.Random, table: Table) -> None:
    places = list(leaves(table) if chance.random() < 0.7 else [("boundary", n) for n in table["boundary"]])
    a, b = chance.choice(places), chance.choice(places)
    first, second = get(table, a), get(table, b)
    put(table, a, second)
    put(table, b, first)


def overlapping(chance: random.Random, table: Table) -> None:
    part = (
        {"on": chance.choice(_SIDES)} | copy.deepcopy(chance.choice(_EFFECTS)) | copy.deepcopy(chance.choice(_EFFECTS))
    )
    table["boundary"]["another"] = part


def missing(chance: random.Random, table: Table) -> None:
    at = chance.choice(list(inner(table)))
    del get(table, at[:-1])[at[-1]]


def not_finite(chance: random.Random, table: Table) -> None:
    at = chance.choice([p for p in leaves(table) if type(get(table, p)) is float])
    put(table, at, chance.choice(_FORMULAS))


def sizes(chance: random.Random, table: Table) -> None:
    """Those of 10⁵ on every side, lest one be a large scene that can be solved."""
    at = ("domain", chance.choice(["size", "cells"]))
    entries = [10**5, 10**9, 2**31, 2**63, -3, 0] if at[1] == "cells" else [1e300, 1e-300, 1e12, 1e-12, 5e-324, 0.0]
    values = list(get(table, at))
    values[chance.randrange(len(values))] = chance.choice(entries)
    put(table, at, [10**5] * len(values) if 10**5 in values else values)


def solver(chance: random.Random, table: Table) -> None:
    chosen = chance.sample(list(_SOLVER), chance.choice([1, 1, 2]))
    table["solver"] = {key: chance.choice(_SOLVER[key]) for key in chosen}


TABLES = [wrong_type, misspelt, other_units, swapped, overlapping, missing, not_finite, sizes, solver]


def text(chance: random.Random, raw: bytes) -> bytes:
    """A file after an editor, a disk or a network had its way with it."""
    at, kind = chance.randrange(len(raw)), chance.randrange(6)
    lines = raw.split(b"\n")
    i, j = chance.randrange(len(lines)), chance.randrange(len(lines))
    if kind == 0:
        return raw[:at]
    if kind == 1:
        return raw[:at] + chance.choice([b"\0", b"\xff", b"[", b'"', b"=", b" nan ", b"\x1b[2J", b"-"]) + raw[at:]
    if kind == 2:
        return raw[:at] + bytes(chance.randrange(1, 99)) + raw[at:]
    if kind == 3:
        lines[i], lines[j] = lines[j], lines[i]
    elif kind == 4:
        del lines[i]
    else:
        lines.insert(j, lines[i])
    return b"\n".join(lines)


def mesh(chance: random.Random, raw: bytes) -> bytes:
    """A gmsh file, one number of it something else, or as :func:`text`."""
    if chance.random() < 0.5:
        return text(chance, raw)
    lines = raw.split(b"\n")
    i = chance.choice([i for i, line in enumerate(lines) if line[:1].isdigit()])
    words = lines[i].split(b" ")
    j = chance.randrange(len(words))
    odd = [b"nan", b"inf", b"-1", b"0", b"99999", b"1e308", b"x", b"", b"0.5", b"1e-300", b"4294967297"]
    words[j] = chance.choice(odd)
    lines[i] = b" ".join(words)
    return b"\n".join(lines)


Grid = dict[str, Any]


def grid(n: int = 3) -> Grid:
    """The unit square as nodes, triangles, lines with their side's number, and names of groups."""
    nodes = [[i / n, j / n, 0.0] for j in range(n + 1) for i in range(n + 1)]
    at = lambda i, j: j * (n + 1) + i + 1  # noqa: E731
    squares = [(i, j) for j in range(n) for i in range(n)]
    cells = [c for i, j in squares for c in ([at(i, j), at(i + 1, j), at(i + 1, j + 1)],
                                              [at(i, j), at(i + 1, j + 1), at(i, j + 1)])]  # fmt: skip
    sides = [[1, at(0, j), at(0, j + 1)] for j in range(n)] + [[2, at(n, j), at(n, j + 1)] for j in range(n)]
    sides += [[3, at(i, 0), at(i + 1, 0)] for i in range(n)] + [[4, at(i, n), at(i + 1, n)] for i in range(n)]
    return {"nodes": nodes, "cells": cells, "sides": sides, "names": ["left", "right", "bottom", "top"]}


def few(chance: random.Random, found: list[Any], most: int) -> list[Any]:
    """Some of a list, as many as there are at most."""
    return chance.sample(found, min(len(found), chance.randrange(1, most + 1)))


def inverted(chance: random.Random, found: Grid) -> None:
    for cell in few(chance, found["cells"], 8):
        cell[0], cell[1] = cell[1], cell[0]


def doubled(chance: random.Random, found: Grid) -> None:
    kind = chance.choice(["cells", "sides"])
    found[kind] += [list(c) for c in few(chance, found[kind], 4)]


def disconnected(chance: random.Random, found: Grid) -> None:
    n = len(found["nodes"])
    found["nodes"] += [[x + 5.0, y, z] for x, y, z in found["nodes"]]
    found["cells"] += [[k + n for k in c] for c in few(chance, found["cells"], 17)]


def emptied(chance: random.Random, found: Grid) -> None:
    gone = chance.randrange(1, 5)
    found["sides"] = [s for s in found["sides"] if s[0] != gone]


def orphaned(chance: random.Random, found: Grid) -> None:
    del found["cells"][chance.randrange(1 + len(found["cells"])) :]


def flattened(chance: random.Random, found: Grid) -> None:
    axis, share = chance.randrange(3), chance.choice([0.0, 1e-13, 1e-200, 1e200, float("nan"), -1.0])
    for node in chance.sample(found["nodes"], chance.choice([1, 4, len(found["nodes"])])):
        node[axis] = node[axis] * share if axis < 2 else share


def misplaced(chance: random.Random, found: Grid) -> None:
    for cell in few(chance, found["cells"], 1):
        cell[chance.randrange(3)] = chance.choice([0, 1, 5, 999, -1])


def crossing(chance: random.Random, found: Grid) -> None:
    """A side drawn through the body, or three cells on one edge."""
    if chance.random() < 0.5:
        found["sides"].append([chance.randrange(1, 5), 1, 6])
    else:
        found["cells"].append([1, 6, chance.randrange(7, 17)])


MESHES = [inverted, doubled, disconnected, emptied, orphaned, flattened, misplaced, crossing]


def msh(found: Grid) -> bytes:
    """As a gmsh file, version 2.2."""
    names = [f'1 {i} "{name}"' for i, name in enumerate(found["names"], 1)] + ['2 9 "body"']
    nodes = [f"{i} {x!r} {y!r} {z!r}" for i, (x, y, z) in enumerate(found["nodes"], 1)]
    elements = [f"1 2 {s} {s} {a} {b}" for s, a, b in found["sides"]]
    elements += [f"2 2 9 9 {a} {b} {c}" for a, b, c in found["cells"]]
    elements = [f"{i} {element}" for i, element in enumerate(elements, 1)]
    sections = {"PhysicalNames": names, "Nodes": nodes, "Elements": elements}
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat"]
    for name, rows in sections.items():
        lines += [f"${name}", str(len(rows)), *rows, f"$End{name}"]
    return "\n".join([*lines, ""]).encode()


def _odd_file(chance: random.Random, folder: Path, good: bytes) -> str:
    """Something else than a scene file where one is wanted."""
    scene, real = folder / "scene.toml", folder / "real.toml"
    ways: dict[str, Callable[[], object]] = {
        "loop": lambda: scene.symlink_to(scene),
        "dangling link": lambda: scene.symlink_to(folder / "absent.toml"),
        "link": lambda: (real.write_bytes(good), scene.symlink_to(real)),
        "folder": scene.mkdir,
        "nothing": lambda: scene.write_bytes(b""),
        "unreadable": lambda: (scene.write_bytes(good), scene.chmod(0)),
        "pipe": lambda: os.mkfifo(scene),
        "device": lambda: scene.symlink_to("/dev/zero"),
        "large": lambda: scene.write_bytes(good + b"#" * 2_000_000),
        "UTF-16": lambda: scene.write_bytes(good.decode().encode("utf-16")),
        "a mesh": lambda: scene.write_bytes(msh(grid())),
    }
    name = chance.choice(list(ways))
    ways[name]()
    return name


def damaged(chance: random.Random, table: Table, ways: list[Any]) -> str:
    """Change a table in one or two ways; what was done."""
    done = chance.sample(ways, chance.choice([1, 1, 1, 2]))
    for damage in done:
        with contextlib.suppress(KeyError, IndexError, TypeError, ValueError, AttributeError):
            damage(chance, table)  # an earlier damage may have taken away what this one works on
    return ", ".join(d.__name__ for d in done)


def make(chance: random.Random, folder: Path) -> str:
    """Write a case into an empty folder, its scene as ``scene.toml``; what was done to it."""
    table, kind = copy.deepcopy(chance.choice(_bases())), chance.randrange(8)
    scene = folder / "scene.toml"
    if kind == 7:
        return f"file: {_odd_file(chance, folder, tomli_w.dumps(table).encode())}"
    if kind == 6:
        scene.write_bytes(text(chance, tomli_w.dumps(table).encode()))
        return "text"
    if kind < 4:
        done = damaged(chance, table, TABLES)
        scene.write_text(tomli_w.dumps(table), encoding="utf-8")
        return done
    found, done = grid(), "text"
    if kind == 4:
        done = damaged(chance, found, MESHES)
    (folder / "m.msh").write_bytes(msh(found) if kind == 4 else mesh(chance, msh(found)))
    table = model(3, friction=quadratic_linear(1e6)) | {"domain": {"shape": "file", "file": "m.msh"}}
    scene.write_text(tomli_w.dumps(table), encoding="utf-8")
    return f"mesh: {done}"

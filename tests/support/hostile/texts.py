"""Scenes with control characters, names of odd kinds, numbers at the edges of double precision, odd TOML; odd paths."""

from __future__ import annotations

import os
import random
from collections.abc import Callable
from pathlib import Path

import tomli_w
from damage import leaves, put

from .case import CHECK, OUT, RUN, SCENE, Case, odd_name, table, write

_EDGES = [
    5e-324,
    2.3e-308,
    1.5e-162,
    1.4e-154,
    1e-100,
    1.3e154,
    1e100,
    1e200,
    1.7976931348623157e308,
    -1.7e308,
    -5e-324,
]
_EDGES += [1 + 2**-52, 2.0**53 + 2, 1e16, 0.5 - 2**-54, -1e-300, 4.9e-324 * 3]
_CONTROLS = [
    "\x1b[2J",
    "\x07",
    "\x7f",
    "\x9b31m",
    "\u202e",
    "\u2028",
    "\r",
    "\n",
    "\t",
    "\0",
    "\u200b",
    "\ufeff",
    "\ud7ff",
]


def edge_number(chance: random.Random, folder: Path) -> Case:
    """One or two numbers of a scene at the edge of double precision."""
    found, done = table() | {"body": {"force": [0.0, -1e4]}}, []
    found["solver"] = {"tolerance": 1e-8, "epsilon": 1e-2, "smoothing": "quadratic"} if chance.random() < 0.3 else {}
    for at in chance.sample([p for p in leaves(found) if _is_number(found, p)], chance.choice([1, 1, 2])):
        put(found, at, chance.choice(_EDGES))
        done.append(".".join(map(str, at)))
    write(folder, found)
    return Case(what=f"edge: {', '.join(done)}")


def _is_number(found: object, at: tuple[str | int, ...]) -> bool:
    for step in at:
        found = found[step]  # type: ignore[index]
    return isinstance(found, float)


def control_characters(chance: random.Random, folder: Path) -> Case:
    """In names, words, keys or comments."""
    found, sign = table(), f"a{chance.choice(_CONTROLS)}b"
    where = chance.choice(["title", "part", "side", "key", "law", "method", "formula", "domain", "comment"])
    parts = found["boundary"]
    ways: dict[str, Callable[[], object]] = {
        "title": lambda: found.update(title=sign), "part": lambda: parts.update({sign: parts.pop("floor")}),
        "side": lambda: parts["floor"].update(on=sign), "key": lambda: parts["floor"].update({sign: 1}),
        "law": lambda: parts["floor"]["friction"].update(law=sign),
        "method": lambda: found.update(solver={"method": sign}),
        "formula": lambda: parts["press"].update(traction=[0.0, sign]),
        "domain": lambda: found["domain"].update(shape=sign),
    }  # fmt: skip
    ways.get(where, lambda: None)()
    text = tomli_w.dumps(found)
    write(folder, text if where != "comment" else f"{text}# {sign}\n")
    return Case(what=f"control character {sign!r} in {where}", words=chance.choice([RUN, CHECK]))


def odd_toml(chance: random.Random, folder: Path) -> Case:
    """What TOML allows, or nearly so."""
    whole = tomli_w.dumps(table())
    deep, tables = "[" * 3000 + "]" * 3000, "\n".join(f"[boundary.p{i}]\non = 'left'" for i in range(2000))
    ways = [
        "\ufeff" + whole,
        whole.replace("\n", "\r\n"),
        whole.replace("\n", "\r"),
        f"x = {deep}\n{whole}",
        whole + tables,
    ]
    ways += [
        f"{whole}\na.{'b.' * 2000}c = 1",
        f"title = 1979-05-27\n{whole}",
        f"title = '''\n'''\n{whole}",
        whole + whole,
    ]
    ways += [
        f"{whole}\n[boundary.floor.contact]\n",
        whole.replace("1000.0", "1_000.0"),
        whole.replace("1000.0", "1e+0003"),
    ]
    ways += [
        whole.replace("0.29", "0x1"),
        whole.replace("0.29", "+nan"),
        whole.replace('"left"', "'''left'''"),
        "\x00" * 4096,
    ]
    ways += [whole.replace("215000000000.0", "9" * 5000), whole.replace("215000000000.0", "0x" + "f" * 5000)]
    ways += [
        whole.replace('"left"', '"\\u006ceft"'),
        whole.replace('"left"', '"\\uD800"'),
        "[" * 100000,
        '"' * 5,
        "= 1",
    ]
    number = chance.randrange(len(ways))
    write(folder, ways[number])
    return Case(what=f"TOML {number}", words=CHECK)


def odd_scene_path(chance: random.Random, folder: Path) -> Case:
    """A scene whose own name or folder is odd, or is reached by links."""
    name = odd_name(chance)
    kind = chance.choice(["name", "folder", "link", "linked folder", "default out"])
    at = {"name": f"{name}.toml", "folder": f"{name}/s.toml", "default out": f"{name}.toml"}.get(kind, "l/s.toml")
    if kind.startswith("link"):
        (folder / name).mkdir()
        write(folder / name, name="s.toml")
        (folder / "l").symlink_to(name)
    else:
        (folder / at).parent.mkdir(exist_ok=True)
        write(folder, name=at)
    scene = at if not at.startswith("-") else f"./{at}"
    if kind == "default out":
        return Case(what=f"scene {at!r}, no --out", words=["run", scene, "--no-pictures"], out="results")
    return Case(what=f"scene {at!r}", words=["run", scene, "--out", OUT, "--no-pictures"])


def odd_out(chance: random.Random, folder: Path) -> Case:
    """An output folder of an odd name or kind."""
    write(folder)
    (folder / "mine").mkdir()
    (folder / "mine" / "thesis.txt").write_text("precious")
    kind = chance.choice(
        ["name", "name", "name", "file", "link", "dangling", "loop", "below file", "special", "deep", "long"]
    )
    target = folder / OUT
    name = {"name": odd_name(chance), "below file": "mine/thesis.txt/r", "deep": "a/" * 300 + "r", "long": "x" * 250}
    name |= {
        "special": chance.choice(["/dev/null", "/proc/r", "/dev/full", "/sys/r", "", ".", "..", "mine", SCENE, "a\n/b"])
    }
    if kind == "file":
        target.write_text("precious")
    elif kind in ("link", "dangling", "loop"):
        target.symlink_to({"link": "mine", "dangling": "absent/r", "loop": OUT}[kind])
    out = name.get(kind, OUT)
    extra = chance.choice([[], [], ["--force"], ["--resume"]])
    words = ["run", SCENE, f"--out={out}", "--no-pictures", *extra]
    return Case(
        what=f"--out {out[:40]!r} ({kind}) {extra}", words=words, out=out if os.path.lexists(target) or out else "."
    )


_SETS = [
    "=",
    "a",
    "a=",
    "=1",
    "domain.cells=[",
    "x.y.z=1",
    "boundary..gap=1",
    "domain=1",
    "boundary.floor=3",
    "\x1b=1",
    "a\nb=1",
]
_SETS += [
    'boundary."a b".on="left"',
    "domain.cells=[2,2]",
    "domain.cells=[2, 2]]",
    "title='a\nb'",
    "solver={}",
    "boundary={}",
]
_SETS += [
    "domain.cells=[2,2]\nx=1",
    "solver.tolerance=1e-8 # x",
    "." * 2000 + "=1",
    "domain.cells.0=3",
    "[a]",
    "[[a]]=1",
    "a=[[",
]
_OPTIONS = [
    "--out",
    "--force",
    "--resume",
    "--accuracy",
    "--quantity",
    "--time-budget",
    "--np",
    "--petsc",
    "--set",
    "--load",
]
_OPTIONS += [
    "--axis",
    "--repeat",
    "--limit",
    "--json",
    "--no-pictures",
    "--ou",
    "--forse",
    "--Out",
    "-o",
    "--",
    "---",
    "-",
    "",
]
_VALUES = [
    "",
    "0",
    "-1",
    "1.5",
    "nan",
    "²",
    "٣",
    "1_0",
    "9" * 5000,
    "1e9",
    "x",
    " 1",
    "0x1",
    "\x1b[2J",
    "\udce9",
    "+1",
    "1,2",
    "mesh=1",
]


def command_line(chance: random.Random, folder: Path) -> Case:
    """Options twice, misspelt, without or with odd values; overrides that are none."""
    write(folder)
    command = chance.choice(["run", "run", "check", "study", "rnu", "version", "", "help", "run.", "--help", "exec"])
    kind = chance.choice(["set", "set", "options", "options", "twice", "shuffled"])
    base = [] if command == "check" else ["--out", OUT]
    sound = {"run": ["--no-pictures"], "study": ["--axis", "epsilon=1", "--repeat", "1", "--limit", "5"]}.get(
        command, []
    )
    words = [command, SCENE, *base, *sound]
    if kind == "set":
        words += [x for _ in range(chance.choice([1, 2])) for x in ("--set", chance.choice(_SETS))]
    elif kind == "options":
        words += [f"{chance.choice(_OPTIONS)}={chance.choice(_VALUES)}"]
    elif kind == "twice":
        words += chance.choice(
            [words[2:], ["--out", "other"], [SCENE], ["--force", "--resume"], ["--force", "--force"]]
        )
    else:
        words += [chance.choice(_OPTIONS)]
        words = chance.sample(words, len(words))
    parallel = any(w.startswith("--np") for w in words)
    return Case(what=f"words {kind}", words=words, alone=parallel, out=OUT if "other" not in words else "other")


KINDS = [
    edge_number,
    edge_number,
    edge_number,
    control_characters,
    odd_toml,
    odd_scene_path,
    odd_out,
    command_line,
    command_line,
]

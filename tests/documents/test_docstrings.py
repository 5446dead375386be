"""Why: docstrings are the reference that users of the package read; one that names half of the arguments misleads.

The rule (Google style): a public function or method of two or more parameters, unless a base class tells about it, has
an ``Args:`` section with a line for each of them; no line of a section packs several names into one; no docstring
begins in the middle of a thought ("Of").
"""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "hvi_fenicsx"
ROOMS = sorted(p.stem for p in PACKAGE.iterdir() if p.suffix == ".py" or (p / "__init__.py").exists())
"""Rooms, and modules that stand alone."""
PACKED = re.compile(r"^(\*{0,2}\w+, )+\*{0,2}\w+: |\. [a-z]\w*(, \w+)*: ")
"""``a, b: ...``, or ``a: ... . b: ...``"""
Function = ast.FunctionDef | ast.AsyncFunctionDef


@functools.cache
def parsed() -> dict[str, ast.Module]:
    """All files of the package."""
    files = sorted(PACKAGE.rglob("*.py"))
    return {str(f.relative_to(PACKAGE)): ast.parse(f.read_text(encoding="utf-8")) for f in files}


@functools.cache
def classes() -> dict[str, ast.ClassDef]:
    """By name."""
    return {node.name: node for tree in parsed().values() for node in ast.walk(tree) if isinstance(node, ast.ClassDef)}


def trees(room: str) -> Iterator[tuple[str, ast.Module]]:
    """The files of a room, or a module, and what they say."""
    yield from ((f, tree) for f, tree in parsed().items() if f == f"{room}.py" or f.startswith(f"{room}/"))


def texts(tree: ast.Module) -> Iterator[str]:
    """All docstrings, those of constants and fields included."""
    for node in ast.walk(tree):
        match node:
            case ast.Expr(value=ast.Constant(value=str() as text)):
                yield text


def public(body: list[ast.stmt]) -> Iterator[Function]:
    """Functions and methods of public names; no methods that a base class tells all about."""
    for node in body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            known = set(inherited(node))
            yield from (method for method in public(node.body) if method.name not in known)
        elif isinstance(node, Function) and not node.name.startswith("_"):
            yield node


def inherited(node: ast.ClassDef) -> Iterator[str]:
    """The names of its base classes' methods."""
    for base in node.bases:
        if isinstance(base, ast.Name) and (above := classes().get(base.id)) and above is not node:
            yield from (method.name for method in above.body if isinstance(method, Function))
            yield from inherited(above)


def parameters(function: Function) -> set[str]:
    """Those that a caller gives, if there are several."""
    given = function.args
    every = [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]
    names = {a.arg for a in every if a is not None and a.arg not in ("self", "cls") and not a.arg.startswith("_")}
    return set() if len(names) < 2 else names


def entries(text: str, *sections: str) -> Iterator[str]:
    """The lines of these sections that begin an entry."""
    inside = False
    for line in text.splitlines():
        if line and not line.startswith(" "):
            inside = line in sections
        elif inside and re.match(r"    \S", line):
            yield line.strip()


@pytest.mark.parametrize("room", ROOMS)
def test_every_parameter_has_a_line_of_its_own(room: str) -> None:
    missing = []
    for file, tree in trees(room):
        for function in public(tree.body):
            lines = entries(ast.get_docstring(function) or "", "Args:")
            told = {line.lstrip("*").partition(":")[0].partition(" ")[0] for line in lines}
            if absent := parameters(function) - told:
                missing.append(f"{file}:{function.lineno} {function.name}: {sorted(absent)}")
    assert not missing, "\n".join(missing)


@pytest.mark.parametrize("room", ROOMS)
def test_no_line_of_a_section_packs_several_names(room: str) -> None:
    packed = []
    for file, tree in trees(room):
        for node in ast.walk(tree):
            if isinstance(node, ast.Module | ast.ClassDef | Function):
                lines = entries(ast.get_docstring(node) or "", "Args:", "Attributes:")
                packed += [f"{file}: {line}" for line in lines if PACKED.search(line)]
    assert not packed, "\n".join(packed)


@pytest.mark.parametrize("room", ROOMS)
def test_no_docstring_begins_in_the_middle_of_a_thought(room: str) -> None:
    said = [(file, text) for file, tree in trees(room) for text in texts(tree)]
    found = [f"{file}: {text.splitlines()[0]}" for file, text in said if text.startswith("Of ")]
    assert not found, "\n".join(found)

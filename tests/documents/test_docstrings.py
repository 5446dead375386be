"""Why: docstrings are the reference that users of the package read; one that names half of the arguments misleads.

The rule (Google style): a public function or method of two or more parameters has an ``Args:`` section with a line for
each of them; no line of a section packs several names into one; no docstring begins in the middle of a thought ("Of").
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "hvi_fenicsx"
COMPLETE = ("cli", "commands", "console", "errors", "geometry", "runtime", "scene", "schema", "typing", "workflow")
"""Rooms, and modules that stand alone, whose docstrings obey the rule."""
PACKED = re.compile(r"^(\*{0,2}\w+, )+\*{0,2}\w+: |[.;] \w+(, \w+)*: ")
"""``a, b: ...``, or ``a: ... . b: ...``"""
Function = ast.FunctionDef | ast.AsyncFunctionDef


def trees(room: str) -> Iterator[tuple[str, ast.Module]]:
    """The files of a room, or a module, and what they say."""
    for file in sorted([*(PACKAGE / room).rglob("*.py"), *PACKAGE.glob(f"{room}.py")]):
        yield str(file.relative_to(PACKAGE)), ast.parse(file.read_text(encoding="utf-8"))


def texts(tree: ast.Module) -> Iterator[str]:
    """All docstrings, those of constants and fields included."""
    for node in ast.walk(tree):
        match node:
            case ast.Expr(value=ast.Constant(value=str() as text)):
                yield text


def public(body: list[ast.stmt]) -> Iterator[Function]:
    """Functions and methods whose names, and whose classes' names, begin with no underscore."""
    for node in body:
        if isinstance(node, Function) and not node.name.startswith("_"):
            yield node
        elif isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield from public(node.body)


def parameters(function: Function) -> set[str]:
    """Those that a caller gives; none where a base class tells what they are."""
    given = function.args
    every = [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]
    names = {a.arg for a in every if a is not None and a.arg not in ("self", "cls") and not a.arg.startswith("_")}
    overrides = any(isinstance(d, ast.Name) and d.id == "override" for d in function.decorator_list)
    return set() if overrides or len(names) < 2 else names


def entries(text: str, *sections: str) -> Iterator[str]:
    """The lines of these sections that begin an entry."""
    inside = False
    for line in text.splitlines():
        if line and not line.startswith(" "):
            inside = line in sections
        elif inside and re.match(r"    \S", line):
            yield line.strip()


@pytest.mark.parametrize("room", COMPLETE)
def test_every_parameter_has_a_line_of_its_own(room: str) -> None:
    missing = []
    for file, tree in trees(room):
        for function in public(tree.body):
            lines = entries(ast.get_docstring(function) or "", "Args:")
            told = {line.lstrip("*").partition(":")[0].partition(" ")[0] for line in lines}
            if absent := parameters(function) - told:
                missing.append(f"{file}:{function.lineno} {function.name}: {sorted(absent)}")
    assert not missing, "\n".join(missing)


@pytest.mark.parametrize("room", COMPLETE)
def test_no_line_of_a_section_packs_several_names(room: str) -> None:
    packed = []
    for file, tree in trees(room):
        for node in ast.walk(tree):
            if isinstance(node, ast.Module | ast.ClassDef | Function):
                lines = entries(ast.get_docstring(node) or "", "Args:", "Attributes:")
                packed += [f"{file}: {line}" for line in lines if PACKED.search(line)]
    assert not packed, "\n".join(packed)


@pytest.mark.parametrize("room", COMPLETE)
def test_no_docstring_begins_in_the_middle_of_a_thought(room: str) -> None:
    said = [(file, text) for file, tree in trees(room) for text in texts(tree)]
    found = [f"{file}: {text.splitlines()[0]}" for file, text in said if text.startswith("Of ")]
    assert not found, "\n".join(found)

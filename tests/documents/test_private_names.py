"""Why: a test that patches a private name breaks when that is renamed, or passes without having changed anything.

What a test must set otherwise is an argument: each room's numbers are the fields of a ``Thresholds``.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

TESTS = Path(__file__).parents[1]


def patched(call: ast.Call) -> str | None:
    """The name that a call of ``setattr`` or ``delattr`` (monkeypatch's) replaces, if it is private."""
    if not isinstance(call.func, ast.Attribute | ast.Name):
        return None
    name = call.func.attr if isinstance(call.func, ast.Attribute) else call.func.id
    if name not in ("setattr", "delattr"):
        return None
    words = [a.value for a in call.args[:2] if isinstance(a, ast.Constant) and isinstance(a.value, str)]
    last = words[0].rpartition(".")[2] if words else ""
    return last if last.startswith("_") and not last.startswith("__") else None


def assigned(node: ast.Assign) -> Iterator[str]:
    """Private attributes of something else that are written to."""
    for target in node.targets:
        if isinstance(target, ast.Attribute) and target.attr.startswith("_"):
            own = isinstance(target.value, ast.Name) and target.value.id in ("self", "cls")
            yield from [] if own else [target.attr]


def test_no_test_patches_a_private_name() -> None:
    found = set()
    for file in sorted(TESTS.rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [patched(node)] if isinstance(node, ast.Call) else []
            names += assigned(node) if isinstance(node, ast.Assign) else []
            found |= {(str(file.relative_to(TESTS)), name) for name in names if name}
    assert sorted(found) == []

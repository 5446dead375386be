"""The scene reference, written from the classes that read a scene, so that it cannot drift from them.

``python3 docs/scene_reference.py > docs/scene.md`` renews the document.
"""

from __future__ import annotations

import inspect
import math
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, TypeVar

from pydantic.fields import FieldInfo

from hvi_fenicsx.effects import Effect, Place
from hvi_fenicsx.formula import FUNCTIONS, Formula
from hvi_fenicsx.laws.base import registered
from hvi_fenicsx.mesh.shapes import DomainShape
from hvi_fenicsx.model.content import PathTable, SolverTable
from hvi_fenicsx.model.reader import BodyTable, BoundaryTable, InterfaceTable, MaterialTable, TopLevel
from hvi_fenicsx.schema import OneOf, Table, meanings

T = TypeVar("T")

_FORMULAS = (
    'A *formula* is a number, or a text in the coordinates x, y, z (m), such as `"-1e6*(1 - 1.8*x)"`. It may contain '
    f"numbers, `pi`, `+ - * / **`, `a if x < 1 else b`, and the functions {', '.join(FUNCTIONS)}."
)
_PLACE = ("origin", "angle")
"""The keys of one of several bodies."""
_INTRODUCTION = """\
# Scene reference

*This page is written by `python3 docs/scene_reference.py` from the classes that read a scene. A test
checks that it is up to date.*

A scene is a TOML file in SI units. An unknown key is an error. A whole number may stand where a number is expected;
a text or a boolean may not. `nan` and `inf` are refused.

{formulas}

The command line can change every value:

| option | what it changes |
|---|---|
| `--set solver.tolerance=1e-10` | one value |
| `--set domain.cells.0=64` | one entry of a list; entries are counted from 0 |
| `--set 'solver.method="branch"'` | a text, in quotes; the outer quotes are for the shell |
| `--set 'solver={}'` | a whole table; here all its keys get their defaults, so the unsmoothed law is solved |

The name of a boundary table (`floor` in `[boundary.floor]`) is the name of the part in the results. Where there are
several bodies, their sides are named `"upper.left"`, and their regions `"upper"`.
"""


def reference() -> str:
    """The whole document, Markdown."""
    return "\n".join(_document()).rstrip() + "\n"


def _document() -> Iterator[str]:
    yield _INTRODUCTION.replace("{formulas}", textwrap.fill(_FORMULAS, 116))
    yield from _table("Top level", TopLevel)
    for name, shape in _provided(DomainShape.registry).items():
        yield from _table(
            f'`[domain]` with `shape = "{name}"`', shape, [k for k in shape.model_fields if k not in _PLACE]
        )
    yield from _table("`[domain.NAME]`, where there are several bodies", DomainShape, _PLACE)
    yield from _table("`[material]`, or `[material.NAME]` where there are several", MaterialTable)
    yield from _effects(Place.MATERIAL, 'The keys of `elasticity = "{key}"`')
    yield from _table("`[body]`, or `[body.NAME]`", BodyTable)
    yield from _effects(Place.BODY, "`{key}` in a body table")
    yield from _table("`[boundary.NAME]`", BoundaryTable)
    yield from _effects(Place.BOUNDARY, "`{key}` in a boundary table")
    yield from _table("`[interface.NAME]`", InterfaceTable)
    yield from _laws()
    yield from _table("`[solver]`", SolverTable)
    yield from _table("`[path]`", PathTable)


def _table(title: str, model: type[Table], only: Iterable[str] | None = None) -> Iterator[str]:
    yield from (f"## {title}", "", _summary(model), "", "| key | value | default |", "|---|---|---|")
    for name in only or model.model_fields:
        yield _row(model, name)
    yield ""


def _effects(place: Place, title: str) -> Iterator[str]:
    for key, kind in _provided(Effect.registry[place]).items():
        yield from (f"### {title.format(key=key)}", "", f"{_summary(kind)} Adds `{kind.term}`.", "")
        fields = [name for name in kind.model_fields if name in meanings(kind)]
        if fields:
            yield from ("| key | value | default |", "|---|---|---|")
            yield from (_row(kind, name) for name in fields)
            yield ""


def _laws() -> Iterator[str]:
    yield from ("## Laws", "", "| `law =` | parameters | |", "|---|---|---|")
    for name, law in _provided(registered()).items():
        parameters = (_parameter(p) for p in inspect.signature(law).parameters.values())
        yield f"| `{name}` | {', '.join(parameters)} | {_escaped(_summary(law))} |"
    yield ""


def _parameter(parameter: inspect.Parameter) -> str:
    default = "" if parameter.default is parameter.empty else f" ({_toml(parameter.default)})"
    return f"`{parameter.name}`{default}"


def _row(model: type[Table], name: str) -> str:
    field = model.model_fields[name]
    text = meanings(model).get(name, "")
    value = ", ".join(filter(None, [_escaped(text), _limits(field), _choices(field)]))
    required = field.is_required() or (name == "shape" and issubclass(model, DomainShape))  # its name tells the kind
    default = "required" if required else _toml(field.get_default(call_default_factory=True))
    return f"| `{name}` | {value} | {default} |"


def _limits(field: FieldInfo) -> str:
    signs = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}
    found = [(sign, getattr(m, key, None)) for m in field.metadata for key, sign in signs.items()]
    return ", ".join(f"{sign} {limit:g}" for sign, limit in found if limit is not None and math.isfinite(limit))


def _choices(field: FieldInfo) -> str:
    """The names of a registry, or of a Literal, also within ``Literal[...] | None``."""
    registries = [m.registered() for m in field.metadata if isinstance(m, OneOf)]
    names = [name for registry in registries for name in _provided(registry)] or _literals(field)
    return "one of " + " ".join(f"`{n}`" for n in names) if len(names) > 1 else ""


def _literals(field: FieldInfo) -> list[str]:
    options = getattr(field.annotation, "__args__", ())
    nested = [a for option in options for a in getattr(option, "__args__", (option,))]
    return [a for a in nested if isinstance(a, str)]


def _provided(registry: Mapping[str, type[T]]) -> dict[str, type[T]]:
    """Those of the program itself; a user's own may be registered too."""
    program = "hvi_fenicsx"
    return {name: kind for name, kind in registry.items() if kind.__module__.startswith(program)}


def _toml(value: Any) -> str:
    if isinstance(value, tuple) and len(value) == 1:
        return _toml(value[0])
    if isinstance(value, Formula):
        return _toml(value.source)
    if value is None or value in ("", ()):
        return "none"
    return f'`"{value}"`' if isinstance(value, str) else f"`{str(value).lower()}`"


def _summary(kind: type) -> str:
    return (inspect.getdoc(kind) or "").split("\n\n")[0].replace("\n", " ").replace("``", "`")


def _escaped(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


if __name__ == "__main__":
    print(reference(), end="")

"""What the fields of a table mean: the texts below them in the source, which are read when someone asks.

pydantic would read them at each start of the program, which takes it a tenth longer.
"""

from __future__ import annotations

import ast
import functools
import inspect
import itertools
import textwrap
from collections.abc import Mapping

from pydantic import BaseModel


@functools.cache
def descriptions(table: type[BaseModel]) -> Mapping[str, str]:
    """The text of each field that has one, by name; of a field that is declared anew, the new one.

    Args:
        table: whose fields.
    """
    found: dict[str, str] = {}
    for kind in reversed(table.__mro__):
        if issubclass(kind, BaseModel):
            anew = inspect.get_annotations(kind)
            found = {name: text for name, text in found.items() if name not in anew} | _texts(kind)
    return {name: found[name] for name in table.model_fields if name in found}


def _texts(kind: type[BaseModel]) -> dict[str, str]:
    """The texts below a class's own fields; none where its source is not at hand."""
    try:
        (definition,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
    except (OSError, TypeError, SyntaxError, ValueError):
        return {}
    assert isinstance(definition, ast.ClassDef)
    found = {}
    for field, below in itertools.pairwise(definition.body):
        match field, below:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(text))):
                found[name] = inspect.cleandoc(text)
    return found

"""Plugins that fail: at import, in the methods of a law, an effect or a method of solution."""

from __future__ import annotations

import random
from pathlib import Path

import tomli_w

from .case import CHECK, RUN, SCENE, Case, table

_RAISES = [
    "ValueError('x')",
    "KeyError",
    "SystemExit(3)",
    "SystemExit(None)",
    "KeyboardInterrupt",
    "GeneratorExit",
    "MemoryError",
]
_RAISES += [
    "BaseException('x')",
    "RecursionError",
    "StopIteration",
    "OSError(28, 'x')",
    "UnicodeError('\\x1b')",
    "Exception()",
]
_RAISES += ["ExceptionGroup('x', [ValueError()])", "AssertionError", "NotImplementedError", "ImportError('x')", "Odd()"]
_ODD = "class Odd(Exception):\n    def __str__(self):\n        raise ValueError('no text')\n"
_IMPORTS = [
    "def f(: pass",
    "import absent",
    "from . import x",
    "f = lambda: f()\nf()",
    "\x00",
    "import hvi_fenicsx.absent",
    "1/0",
]
_IMPORTS += [
    "import sys; sys.exit('words')",
    "import sys; sys.stdout.write('x' * 9)",
    "import os; os.chdir('/')",
    "#" * 99999,
]
_IMPORTS += [
    "import warnings; warnings.warn('\\x1b[2J')",
    "from hvi_fenicsx import laws\nclass A(laws.PolylineLaw): name = 3",
]
_IMPORTS += [
    "from hvi_fenicsx import laws\nclass A(laws.PolylineLaw): name = 'graph'",
    "x" * 9999,
    "\x1b = 1",
    "async def",
    "\tx\n  y",
]
_IMPORTS += [
    "from hvi_fenicsx.effects import Effect\nclass A(Effect): key = 'contact'",
]
_RETURNS = [
    "None",
    "'x'",
    "[]",
    "{}",
    "1j * x",
    "np.nan * x",
    "np.inf + x",
    "np.zeros((3, 3))",
    "x[:1]",
    "[[1]]",
    "object()",
    "1e308 * x",
]
_RETURNS += [
    "np.array(['a'])",
    "True",
    "x.astype(complex)",
    "lambda: 1",
    "np.full(np.shape(x), None)",
    "-1e308 * x",
    "x > 0",
    "5e-324",
]
_LAW = """import numpy as np
from dataclasses import dataclass
from hvi_fenicsx import laws
{odd}
@dataclass(frozen=True)
class Mine(laws.SampledLaw):
    name = {name!r}
    strength: float

    def traction(self, x):
        {traction}

    def ends(self):
        {ends}
"""
_EFFECT = """import ufl, numpy as np
from hvi_fenicsx.effects import Contribution, Drive, Effect, FormulaField, Place, SurfaceLoad
{odd}
class Mine(Effect):
    key = {name!r}
    place = Place.BOUNDARY
    drive = Drive.LOAD
    term = "x"
    value: FormulaField

    def contribute(self, context, where):
        x = context
        {contribute}

    def stress_scale(self, largest, sizes):
        x = 1.0
        {scale}
"""
_METHOD = """import numpy as np
from hvi_fenicsx.solvers import Method
{odd}
class Mine(Method):
    name = {name!r}
    description = "x"

    def solve(self, start=None):
        x = self.context
        {solve}
"""


def _body(chance: random.Random, sound: str, share: float) -> str:
    if chance.random() > share:
        return sound
    return f"raise {chance.choice(_RAISES)}" if chance.random() < 0.5 else f"return {chance.choice(_RETURNS)}"


def plugin_import(chance: random.Random, folder: Path) -> Case:
    """A file that raises when it is read, that is none, or defines what is there."""
    kind = chance.choice(["raise", "code", "code", "file"])
    file = f"p{folder.name}.py"
    if kind == "raise":
        text = f"{_ODD}raise {chance.choice(_RAISES)}\n"
        (folder / file).write_text(text)
    elif kind == "code":
        (folder / file).write_text(chance.choice(_IMPORTS))
    else:
        file = chance.choice(
            ["absent.py", "d.py", "p.txt", "latin.py", "", "loop.py", "/dev/null", "a\nb.py", "\x1b.py"]
        )
        (folder / "d.py").mkdir()
        (folder / "latin.py").write_bytes(b"x = '\xe9'\n")
        (folder / "loop.py").symlink_to("loop.py")
    (folder / SCENE).write_text(tomli_w.dumps({"plugins": file, **table()}), encoding="utf-8")
    return Case(what=f"plugin: {kind} {file!r}", words=chance.choice([CHECK, RUN]), ours=("__pycache__",))


def plugin_method(chance: random.Random, folder: Path) -> Case:
    """A law, an effect or a method whose functions raise or return something else."""
    kind, found = chance.choice(["law", "law", "effect", "method"]), table()
    name = f"mine{folder.name}"  # no two of one process may have the same
    floor = found["boundary"]["floor"]
    if kind == "law":
        ends, traction = _body(chance, "return [1e-6]", 0.4), _body(chance, "return 0 * x + self.strength", 0.8)
        text = _LAW.format(
            odd=_ODD, name=name, traction=traction, ends=ends.replace("x", "np.zeros(2)") if "'x'" not in ends else ends
        )
        floor["friction"] = {"law": name, "strength": 1e3}
    elif kind == "effect":
        contribute, scale = (
            _body(chance, "return Contribution()", 0.8),
            _body(chance, "return largest(self.value)", 0.5),
        )
        text = _EFFECT.format(odd=_ODD, name=name, contribute=contribute, scale=scale)
        found["boundary"]["press"][name] = {"value": 1e5}
    else:
        text = _METHOD.format(odd=_ODD, name=name, solve=_body(chance, "return None", 1.0))
        found["solver"] = {"method": name}
    (folder / f"{name}.py").write_text(text)
    (folder / SCENE).write_text(tomli_w.dumps({"plugins": f"{name}.py", **found}), encoding="utf-8")
    returned = [line.strip() for line in text.splitlines() if line.startswith("        r")]
    return Case(what=f"plugin {kind}: {'; '.join(returned)}", ours=("__pycache__",))


KINDS = [plugin_import, plugin_method, plugin_method]

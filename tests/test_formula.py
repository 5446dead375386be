"""Formulas: NumPy and UFL agree with Python's own arithmetic, and nothing but arithmetic passes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hvi_fenicsx.errors import InputError
from hvi_fenicsx.formula import Formula, ufl_algebra

_PYTHON: dict[str, Callable[..., Any]] = {
    "abs": abs, "sqrt": math.sqrt, "exp": math.exp, "log": math.log, "sin": math.sin, "cos": math.cos,
    "tan": math.tan, "sinh": math.sinh, "cosh": math.cosh, "tanh": math.tanh, "min": min, "max": max,
}  # fmt: skip
_ONE = [name for name in _PYTHON if name not in ("min", "max")]
_LEAVES = st.sampled_from(["x", "y", "z", "pi", "0", "2", "-1.5", "0.25", "1e-3", "3"])

_COMPARISONS = st.sampled_from(["<", "<=", ">", ">="])


def _grown(children: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    return (
        st.builds("({} {} {})".format, children, st.sampled_from("+-*/"), children)
        | st.builds("(-{})".format, children)
        | st.builds("({})**{}".format, children, st.sampled_from(["2", "3", "-1"]))
        | st.builds("{}({})".format, st.sampled_from(_ONE), children)
        | st.builds("{}({}, {})".format, st.sampled_from(["min", "max"]), children, children)
        | st.builds("({} if {} {} {} else {})".format, children, children, _COMPARISONS, children, children)
    )  # fmt: skip


FORMULAS = st.recursive(_LEAVES, _grown, max_leaves=8)
COORDINATES = st.tuples(*[st.floats(-3, 3).map(lambda v: round(v, 3))] * 3)


def by_python(source: str, point: tuple[float, float, float]) -> float | None:
    """The value by Python itself (``eval`` of a formula made here); None where that is no finite number."""
    names = {**_PYTHON, "pi": math.pi, **dict(zip("xyz", point, strict=True))}
    try:
        value = eval(source, {"__builtins__": {}}, names)
    except (ArithmeticError, ValueError):
        return None
    return float(value) if not isinstance(value, complex) and math.isfinite(value) else None


# In a search with new examples a chance cancellation may enlarge the last digit, in which libraries may differ.
@settings(max_examples=400)
@given(FORMULAS, COORDINATES)
def test_numpy_agrees_with_python(source: str, point: tuple[float, float, float]) -> None:
    wanted = by_python(source, point)
    try:
        value = Formula(source).at(np.array([point]))[0]
    except InputError:  # a formula without coordinates is refused at once where it has no value
        assert not set("xyz") & set(source.replace("max", "").replace("exp", "")) or wanted is None
        return
    if wanted is not None:
        assert value == pytest.approx(wanted, rel=1e-9, abs=1e-300)


@settings(max_examples=100)
@given(FORMULAS, COORDINATES)
def test_ufl_agrees_with_numpy(source: str, point: tuple[float, float, float]) -> None:
    wanted = by_python(source, point)
    if wanted is None:
        return
    import ufl

    form = _formula(source)
    if form is None:
        return
    cell = ufl.Mesh(_vector_element())
    x = ufl.SpatialCoordinate(cell)
    rendered = form.render(x, ufl_algebra(ufl.as_ufl))
    value = rendered if isinstance(rendered, int | float) else rendered(point)
    assert float(value) == pytest.approx(wanted, rel=1e-9, abs=1e-300)


def _formula(source: str) -> Formula | None:
    try:
        return Formula(source)
    except InputError:
        return None


def _vector_element() -> Any:
    import basix.ufl

    return basix.ufl.element("Lagrange", "tetrahedron", 1, shape=(3,))


def test_compiled_forms_agree(tmp_path: Any) -> None:
    dolfinx = pytest.importorskip("dolfinx")
    import ufl
    from mpi4py import MPI

    mesh = dolfinx.mesh.create_unit_square(MPI.COMM_SELF, 2, 2)
    formula = Formula("-2*(1 - 1.8*x)**2 + max(x, y)*exp(-z) + (3 if x < 0.4 else y**-1) + abs(x - y) + 0*pi")
    constant = lambda value: dolfinx.fem.Constant(mesh, value)  # noqa: E731
    rendered = formula.render(ufl.SpatialCoordinate(mesh), ufl_algebra(constant))
    inside = np.array([[0.3, 0.2], [0.2, 0.3]])
    expression = dolfinx.fem.Expression(rendered, inside)
    cells = np.arange(mesh.topology.index_map(2).size_local, dtype=np.int32)
    coordinates = dolfinx.fem.Expression(ufl.SpatialCoordinate(mesh), inside).eval(mesh, cells)
    points = np.pad(coordinates.reshape(-1, 2), ((0, 0), (0, 1)))
    assert expression.eval(mesh, cells).reshape(-1) == pytest.approx(formula.at(points), rel=1e-12)


REFUSED = {
    "attribute": ("x.real", "is not allowed"),
    "dunder attribute": ("x.__class__", "is not allowed"),
    "dunder name": ("__import__", "'__import__' in '__import__' is not known"),
    "call of a foreign function": ("open(x)", "function 'open'"),
    "import": ("__import__('os')", "function '__import__'"),
    "misspelt function": ("sqr(x)", "did you mean 'sqrt'?"),
    "call of a call": ("sin(x)(x)", "is not allowed"),
    "keyword": ("sin(x=1)", "is not allowed"),
    "star": ("max(*x)", "takes 2 arguments, not 1"),
    "one argument too many": ("sin(x, y)", "takes 1 argument, not 2"),
    "function without call": ("sin*x", "write sin(...)"),
    "lambda": ("lambda: 0", "is not allowed"),
    "comprehension": ("[x for x in y]", "is not allowed"),
    "walrus": ("(x := 1)", "is not allowed"),
    "index": ("x[0]", "is not allowed"),
    "tuple": ("x, y", "is not allowed"),
    "text": ("'x'", "is not allowed"),
    "format": ("f'{x}'", "is not allowed"),
    "boolean": ("True", "is not a real number"),
    "imaginary": ("1j", "is not a real number"),
    "dots": ("...", "is not allowed"),
    "none": ("None", "is not allowed"),
    "logic": ("x and y", "is not allowed"),
    "comparison outside a condition": ("x < y", "is not allowed"),
    "chain": ("1 if 0 < x < 1 else 2", "is not allowed"),
    "remainder": ("x % 2", "is not allowed"),
    "bits": ("x ^ 2", "is not allowed"),
    "huge power": ("x**1000", "too large"),
    "huge negative power": ("x**-1000", "too large"),
    "tower": ("9**9**9", "not a finite number"),
    "infinite number": ("1e999*x", "is not finite"),
    "many digits": ("1" + "0" * 400 + "*x", "is not finite"),
    "division by zero": ("1/0", "not a finite number"),
    "no real value": ("sqrt(-1)", "not a finite number"),
    "deep": ("-" * 60 + "x", "nested more than 50 deep"),
    "very deep": ("-" * 1900 + "x", "nested more than 50 deep"),
    "deep in what is refused": ("not " * 480 + "x", "is not allowed"),
    "deep attributes": ("x" + ".a" * 900, "is not allowed"),
    "brackets": ("(" * 900 + "x" + ")" * 900, "is not a formula"),
    "long": ("x+" * 1000 + "x", "2000 at most"),
    "comment": ("x # y", "comment"),
    "statement": ("x = 1", "is not a formula"),
    "two lines": ("x\ny", "is not a formula"),
    "null": ("x\0", "is not a formula"),
    "empty": ("", "is not a formula"),
    "foreign name": ("1e6*t", "may use x, y, z and pi"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_formula(case: str) -> None:
    source, words = REFUSED[case]
    with pytest.raises(InputError) as caught:
        Formula(source)
    assert words in str(caught.value)


@pytest.mark.parametrize("value", [math.nan, math.inf, True, None, 10**400, [1]])
def test_what_is_no_number(value: Any) -> None:
    with pytest.raises(InputError, match="must be a"):
        Formula(value)


@settings(max_examples=500)
@given(st.text(alphabet="xyzpi0123456789.e+-*/() ,<>=ifelsanbdlmr_[]:'\n\\", max_size=40) | st.text(max_size=20))
def test_any_text_is_a_formula_or_refused(source: str) -> None:
    try:
        formula = Formula(source)
    except InputError:
        return
    assert formula.at(np.zeros((2, 3))).shape == (2,)

"""A program with many effects must be told which of them is wrong, and no value may be taken for another in silence."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

import hvi_fenicsx as hvi
from hvi_fenicsx.effects import Contribution, Effect, FormContext, Place

STEEL = hvi.Isotropic(youngs_modulus=2e11, poisson_ratio=0.3)


class Weight(Effect):
    """The weight of steel, as a user would write it."""

    key = "weight of a test"
    place = Place.BODY
    term = "<g, v> += -∫ ρ g v_y dx"

    def contribute(self, context: FormContext, where: str | None) -> Contribution:
        weight = context.number(-7850.0 * 9.81 * context.length / context.stress)
        return Contribution(linear=(weight * context.test[1] * context.cells(where),))


@pytest.fixture(scope="module")
def square() -> hvi.Body:
    return hvi.Body.rectangle([1.0, 1.0], [2, 2])


def modelled(body: hvi.Body, effect: Any) -> hvi.Model:
    """The model of an effect, with steel where it is no material itself."""
    return hvi.Model(body, [effect] if effect.place is Place.MATERIAL else [STEEL, effect])


def solved(body: hvi.Body, traction: Any) -> hvi.Solution:
    held = hvi.Displacement("left", [0.0, 0.0])
    return hvi.solve(hvi.Model(body, [STEEL, held, hvi.Traction("right", traction)]), estimate=False)


@pytest.mark.parametrize(
    ("effect", "reason"),
    [
        (
            lambda: hvi.Isotropic(youngs_modulus=1e9, poisson_ratio=0.5),
            r"^Isotropic on the body: poisson_ratio: must be less",
        ),
        (
            lambda: hvi.Isotropic(youngs_modulus="2e11", poisson_ratio=0.3),
            "youngs_modulus: must be a number .*without quotes",
        ),  # type: ignore[arg-type]
        (lambda: hvi.Anisotropic(matrix=3), "^Anisotropic on the body: matrix: must be a list"),  # type: ignore[arg-type]
        (
            lambda: hvi.Orthotropic(youngs_moduli=[1, 1], poisson_ratios=[0], shear_moduli=3),
            "shear_moduli: must be a list",
        ),  # type: ignore[arg-type]
        (lambda: hvi.Displacement("left", [np.nan, 0.0]), "^Displacement on left: values.0: must be a finite number"),
        (lambda: hvi.Force("right", [lambda x: x[0], 0.0]), "^Force on right: is the sum over the part: numbers only"),  # type: ignore[list-item]
        (
            lambda: hvi.Moment("right", [1.0, 2.0, 3.0]),
            "^Moment on right: moment has 3 components; in 2D it is one number",
        ),
        (lambda: hvi.Displacement("left", [[0.0], 0.0]), "values.0: .*; or write .free. .None from Python. to leave"),
        (
            lambda: hvi.Isotropic(youngs_modulus=1e9, poisson_ratio=0.3, model="three_dimensional"),
            "is not for 2D; use plane",
        ),
        (lambda: hvi.Contact("bottom", obstacle=3), "^Contact on bottom: obstacle: must be a table with a shape"),  # type: ignore[arg-type]
        (lambda: hvi.Friction("bottom", "graph"), "^Friction on bottom: law .graph.: points missing"),  # type: ignore[arg-type]
    ],
)
def test_a_refusal_names_the_effect_and_its_place(square: hvi.Body, effect: Any, reason: str) -> None:
    with pytest.raises(hvi.InputError, match=reason):
        modelled(square, effect())


@pytest.mark.parametrize(
    ("argument", "reason"),
    [
        ({"estimate": "no"}, "^estimate: must be true or false"),
        ({"estimate": None}, "^estimate: must be true or false"),
        ({"progress": True}, "^progress: must be a function"),
    ],
)
def test_what_is_no_switch_or_no_function_is_refused(square: hvi.Body, argument: Any, reason: str) -> None:
    model = hvi.Model(square, [STEEL, hvi.Displacement("left", [0.0, 0.0])])
    with pytest.raises(hvi.InputError, match=reason):
        hvi.solve(model, **argument)


@pytest.mark.parametrize(
    ("argument", "reason"),
    [
        ({"gap": "1e-8"}, "^gap: must be a number"),
        ({"gap": 1}, "^gap: must be less than 1 .is 1"),
        ({"limit": "60"}, "^limit: must be a number"),
        ({"limit": 0}, "^limit: must be greater than 0 .is 0"),
        ({"lowest": "no"}, "^lowest: must be true or false"),
    ],
)
def test_a_search_for_equilibria_refuses_numbers_that_mean_nothing(
    square: hvi.Body, argument: Any, reason: str
) -> None:
    model = hvi.Model(square, [STEEL, hvi.Displacement("left", [0.0, 0.0])])
    with pytest.raises(hvi.InputError, match=reason):
        hvi.equilibria(model, **argument)


def test_numbers_may_be_of_any_kind(square: hvi.Body) -> None:
    """NumPy's are no Python floats, and its arrays no lists."""
    diagonal = hvi.Model(square, [hvi.Anisotropic(matrix=np.diag(np.float32([2, 2, 1])))])  # type: ignore[arg-type]
    single = hvi.Model(square, [hvi.Isotropic(youngs_modulus=np.float32(2), poisson_ratio=np.array(0.0))])  # type: ignore[arg-type]
    plain = hvi.Model(square, [hvi.Isotropic(youngs_modulus=2.0, poisson_ratio=0.0)])
    assert single == plain
    assert hvi.Model(square, [hvi.Anisotropic(matrix=[[2, 0, 0], [0, 2, 0], [0, 0, 1]])]) == diagonal


@pytest.mark.parametrize(
    ("traction", "reason"),
    [
        (lambda x: x, "must return 2 components"),
        (lambda x: 1.0, "must return 2 components"),
        ([lambda x: 1j * x[0], 0.0], "returns complex128 values .*; return real numbers"),
    ],
)
def test_a_function_with_values_of_another_kind_is_refused(square: hvi.Body, traction: Any, reason: str) -> None:
    """The third component of a function of points, and an imaginary part, were left away."""
    with pytest.raises(hvi.InputError, match=reason):
        solved(square, traction)


def test_an_effect_of_the_users_own_acts_in_the_volume(square: hvi.Body) -> None:
    """Against the body force of the program itself."""
    held = hvi.Displacement("bottom", [0.0, 0.0])
    known = hvi.BodyForce([0.0, -7850.0 * 9.81])
    energies = [
        hvi.solve(hvi.Model(square, [STEEL, held, load]), estimate=False).energy for load in (known, Weight().at(None))
    ]
    assert energies[1] == pytest.approx(energies[0], rel=1e-10)
    assert energies[0] < 0.0


@pytest.mark.parametrize("true", [True, np.True_])
@pytest.mark.parametrize(
    "effect",
    [
        lambda true: hvi.Isotropic(youngs_modulus=true, poisson_ratio=0.3),
        lambda true: hvi.Anisotropic(matrix=[[2, 0, 0], [0, true, 0], [0, 0, 1]]),
        lambda true: hvi.Displacement("left", [true, 0.0]),
        lambda true: hvi.Force("right", [true, 0.0]),
        lambda true: hvi.Moment("right", true),
        lambda true: hvi.Temperature(true),
        lambda true: hvi.Contact("bottom", gap=true),
        lambda true: hvi.Contact("bottom", obstacle={"shape": "sphere", "center": [0.0, -1.0], "radius": true}),
        lambda true: hvi.Friction("bottom", hvi.laws.Tresca(1.0), multiplier=true),
        lambda true: hvi.Cohesion("bottom", hvi.laws.Tresca(1.0), beta=true),
    ],
)
def test_a_boolean_is_no_number(square: hvi.Body, effect: Any, true: Any) -> None:
    """Python counts True as 1, and so it was taken."""
    with pytest.raises(hvi.InputError, match=r"must be .*number.*|must be greater than|usable|numbers only"):
        modelled(square, effect(true))


@pytest.mark.parametrize(
    "options",
    [{"tolerance": True}, {"max_iterations": True}, {"epsilon": True}, {"start": [True, 0.0]}, {"degree": True}],
)
def test_a_boolean_is_no_option(square: hvi.Body, options: Any) -> None:
    with pytest.raises(hvi.InputError, match=r"must be .*is true|must be a number .*not true"):
        hvi.check(hvi.Model(square, [STEEL, hvi.Displacement("left", [0.0, 0.0])]), **options)


def test_a_contradiction_names_effects_and_places(square: hvi.Body) -> None:
    with pytest.raises(hvi.InputError) as refused:
        hvi.Model(square, [STEEL, hvi.Displacement("bottom", [None, 0.0]), hvi.Contact("bottom")])
    assert str(refused.value) == (
        'boundary.bottom.contact: the displacement normal to "bottom" is prescribed by boundary.bottom.displacement; '
        'leave contact out or write "free" there'
    )


@pytest.mark.parametrize(
    ("made", "reason"),
    [
        (lambda model: hvi.read_scene(3), "^path: must be a path.* .is 3"),  # type: ignore[arg-type]
        (lambda model: hvi.study(model, True), "^folder: must be a path.* .is True"),
        (lambda model: hvi.solve(model, estimate=False).write(True), "^folder: must be a path.* .is True"),
        (lambda model: hvi.solve(model, estimate=False).plot([1.0]), "^picture: must be the name.* .is .1.0"),
    ],
)
def test_a_value_of_another_kind_is_refused_in_words(square: hvi.Body, made: Any, reason: str) -> None:
    """They raised a bare TypeError or AttributeError."""
    with pytest.raises(hvi.InputError, match=reason):
        made(hvi.Model(square, [STEEL, hvi.Displacement("left", [0.0, 0.0]), hvi.Traction("right", [1e6, 0.0])]))


def hooke(u: Any, v: Any) -> Any:
    return 1e9 * ufl.inner(ufl.sym(ufl.grad(u)), ufl.sym(ufl.grad(v)))


@pytest.mark.parametrize(
    "form",
    [
        lambda u, v: np.nan * hooke(u, v) * ufl.dx,
        lambda u, v: fem.Constant(u.ufl_function_space().mesh, np.inf) * hooke(u, v) * ufl.dx,
        lambda u, v: ufl.inner(u, u) * hooke(u, v) * ufl.dx,
        lambda u, v: ufl.exp(u[0]) * v[0] * ufl.dx,
        lambda u, v: hooke(u, v) * ufl.dx + v[0] * ufl.dx,
        lambda u, v: hooke(u, v) * ufl.dS,
        lambda u, v: 1 / 0,
        lambda u: u,
    ],
)
def test_an_energy_that_is_none_is_refused_in_words(square: hvi.Body, form: Any) -> None:
    """UFL's, the compiler's and Python's own errors came through."""
    with pytest.raises(hvi.InputError, match=r"^Energy on the body: (the form|a number|the function)"):
        hvi.Model(square, [hvi.Energy(form)])


def tagged(indices: list[int], values: Any) -> Callable[[], hvi.Body]:
    def made() -> hvi.Body:
        square = mesh.create_unit_square(MPI.COMM_WORLD, 2, 2)
        square.topology.create_connectivity(1, 2)
        found = mesh.meshtags(square, 1, np.array(indices, dtype=np.int32), np.array(values))
        return hvi.Body(square, facets=found, names={"wall": 1})

    return made


def bent(square: mesh.Mesh, node: float) -> mesh.Mesh:
    square.geometry.x[0, 2] = node
    return square


WORDS = np.array(["left", "top"])


@pytest.mark.parametrize(
    ("made", "reason"),
    [
        (tagged([0, 9999], [1, 1]), "body: facets: the mesh has no facet 9999"),
        (tagged([-5, 0], [1, 1]), "no facet -5"),
        (tagged([0, 1], [1.0, np.nan]), "meshtags"),
        (lambda: hvi.Body(bent(mesh.create_unit_square(MPI.COMM_WORLD, 2, 2), np.nan)), "no finite number"),
        (lambda: hvi.Body.rectangle([1.0, 1.0], [2, 2], WORDS), "comm"),  # type: ignore[arg-type]
        (lambda: hvi.Body.rectangle([1.0, 1.0], [2, 2]).interface("seam", WORDS, "top"), "interface: must be a text"),  # type: ignore[arg-type]
        (lambda: hvi.Body.rectangle([1.0, 1.0], [2, 2]).piece("seam", "top", WORDS), "must be a text"),  # type: ignore[arg-type]
        (lambda: hvi.Model(hvi.Body.rectangle([1.0, 1.0], [2, 2]), [STEEL], WORDS), "title: must be a text"),  # type: ignore[arg-type]
        (lambda: hvi.Force("left", [10**400, 0.0]), "OverflowError"),
        (lambda: hvi.laws.Tresca(10**400), "finite number"),
        (lambda: hvi.laws.create(WORDS, {}), "^law: TypeError"),  # type: ignore[arg-type]
    ],
)
def test_what_numpy_and_dolfinx_would_refuse_is_refused_in_words(made: Any, reason: str) -> None:
    with pytest.raises(hvi.InputError, match=reason):
        made()


@pytest.mark.parametrize(
    "traction",
    [
        lambda x: 1 / 0,
        lambda: 1.0,
        [lambda x: x[7], 0.0],
        [lambda x: [[1], [1, 2]], 0.0],
        lambda x: ufl.jump(x[0]),
    ],
)
def test_a_load_that_raises_is_refused_in_words(square: hvi.Body, traction: Any) -> None:
    """Also what is of two cells, on which dolfinx crashed."""
    if getattr(traction, "__code__", None) is not None and "jump" in traction.__code__.co_names:
        traction = [traction(ufl.SpatialCoordinate(square.mesh)), 0.0]
    with pytest.raises(hvi.InputError):
        solved(square, traction)


@pytest.mark.parametrize("before", [True, False])
def test_a_mesh_that_is_moved_is_refused(before: bool) -> None:
    """What is kept with a body was that of its mesh as it had been."""
    square = mesh.create_unit_square(MPI.COMM_WORLD, 2, 2)
    model = hvi.Model(hvi.Body(square), [STEEL])
    if before:
        hvi.check(model)
    square.geometry.x[:] *= 2.0
    with pytest.raises(hvi.InputError, match="nodes of its mesh have been moved"):
        hvi.solve(model)
    hvi.check(hvi.Model(hvi.Body(square), [STEEL]))

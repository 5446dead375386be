"""A program with many effects must be told which of them is wrong, and no value may be taken for another in silence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

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


class Pull(Weight):
    key = "pull of a test"
    place = Place.BOUNDARY
    in_files = False


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
            lambda: hvi.Isotropic(youngs_modulus="steel", poisson_ratio=0.3),
            "^Isotropic on the body: youngs_modulus: must be a number",
        ),  # type: ignore[arg-type]
        (
            lambda: hvi.Isotropic(youngs_modulus="2e11", poisson_ratio=0.3),
            "youngs_modulus: must be a number .*without quotes",
        ),  # type: ignore[arg-type]
        (
            lambda: hvi.Isotropic(youngs_modulus=10**400, poisson_ratio=0.3),
            "^Isotropic on the body: youngs_modulus: must be a n",
        ),
        (lambda: hvi.Anisotropic(matrix=3), "^Anisotropic on the body: matrix: must be a list"),  # type: ignore[arg-type]
        (
            lambda: hvi.Anisotropic(matrix=[[1, 0, 0], 4, [0, 0, 1]]),
            "^Anisotropic on the body: matrix.1: must be a list",
        ),  # type: ignore[list-item]
        (
            lambda: hvi.Orthotropic(youngs_moduli=[1, 1], poisson_ratios=[0], shear_moduli=3),
            "shear_moduli: must be a list",
        ),  # type: ignore[arg-type]
        (lambda: hvi.Energy(3), "^Energy on the body: form: must be a function"),  # type: ignore[arg-type]
        (lambda: hvi.Displacement("left", [np.nan, 0.0]), "^Displacement on left: values.0: must be a finite number"),
        (lambda: hvi.Force("right", [lambda x: x[0], 0.0]), "^Force on right: is the sum over the part: numbers only"),  # type: ignore[list-item]
        (lambda: hvi.Moment("right", None), "^Moment on right: is the sum over the part: numbers only"),  # type: ignore[arg-type]
        (lambda: hvi.Moment("right", [np.inf]), "^Moment on right: values.0: must be a finite number"),
        (
            lambda: hvi.Moment("right", [1.0, 2.0, 3.0]),
            "^Moment on right: moment has 3 components; in 2D it is one number",
        ),
        (lambda: hvi.Traction("right", [0.0, None]), "^Traction on right: values.1: must be a number or a formula"),
        (lambda: hvi.Force("right", [1.0]), "^Force on right: force has 1 components; in 2D it has 2"),
        (lambda: hvi.Displacement("left", [[0.0], 0.0]), "values.0: .*; or write .free. .None from Python. to leave"),
        (lambda: hvi.Contact("bottom", lower=0.0, upper=np.inf), "^Contact on bottom: upper: must be a finite number"),
        (
            lambda: hvi.Contact("bottom", gap=0.0, direction=[0, 0, 1]),
            "contact.direction has 3 components; in 2D it has 2",
        ),
        (
            lambda: hvi.Isotropic(youngs_modulus=1e9, poisson_ratio=0.3, model="three_dimensional"),
            "is not for 2D; use plane",
        ),
        (lambda: hvi.Contact("bottom", obstacle=3), "^Contact on bottom: obstacle: must be a table, like"),  # type: ignore[arg-type]
        (lambda: hvi.Friction("bottom", "graph"), "^Friction on bottom: law .graph.: points missing"),  # type: ignore[arg-type]
        (lambda: hvi.Cohesion("bottom", hvi.laws.Tresca(1.0), mixity="power_law"), "belong together: state all"),  # type: ignore[arg-type]
        (
            lambda: hvi.Traction("right", np.array(3.0)),
            "^Traction on right: must be a list, one entry",
        ),
        (lambda: hvi.Moment("right", b"3"), "^Moment on right: is the sum over the part"),  # type: ignore[arg-type]
    ],
)
def test_a_refusal_names_the_effect_and_its_place(square: hvi.Body, effect: Any, reason: str) -> None:
    with pytest.raises(hvi.InputError, match=reason):
        modelled(square, effect())


@pytest.mark.parametrize(
    ("argument", "reason"),
    [
        ({"estimate": "no"}, "^estimate: must be True or False .is 'no'"),
        ({"estimate": None}, "^estimate: must be True or False .is None"),
        ({"progress": True}, "^progress: give a function of one hvi.NewtonStep, such as print, not True"),
    ],
)
def test_what_is_no_switch_or_no_function_is_refused(square: hvi.Body, argument: Any, reason: str) -> None:
    model = hvi.Model(square, [STEEL, hvi.Displacement("left", [0.0, 0.0])])
    with pytest.raises(hvi.InputError, match=reason):
        hvi.solve(model, **argument)


@pytest.mark.parametrize(
    ("argument", "reason"),
    [
        ({"gap": "1e-8"}, "^gap: must be a number above 0 and below 1 .is '1e-8'"),
        ({"gap": 1}, "^gap: must be a number above 0 and below 1 .is 1"),
        ({"limit": "60"}, "^limit: must be a number above 0 .is '60'"),
        ({"limit": 0}, "^limit: must be a number above 0 .is 0"),
        ({"lowest": "no"}, "^lowest: must be True or False .is 'no'"),
    ],
)
def test_a_search_for_equilibria_refuses_numbers_that_mean_nothing(
    square: hvi.Body, argument: Any, reason: str
) -> None:
    model = hvi.Model(square, [STEEL, hvi.Displacement("left", [0.0, 0.0])])
    with pytest.raises(hvi.InputError, match=reason):
        hvi.equilibria(model, **argument)


def test_a_scale_that_is_no_number_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "part.msh"
    file.touch()
    with pytest.raises(hvi.InputError, match="scale: must be a number"):
        hvi.Body.file(file, scale="mm")  # type: ignore[arg-type]


def test_each_wrong_value_of_an_effect_has_a_line_with_its_name(square: hvi.Body) -> None:
    with pytest.raises(hvi.InputError) as refused:
        hvi.Model(square, [hvi.Isotropic(youngs_modulus="steel", poisson_ratio=0.7)])  # type: ignore[arg-type]
    assert str(refused.value).splitlines() == [
        'Isotropic on the body: youngs_modulus: must be a number (is "steel")',
        "Isotropic on the body: poisson_ratio: must be less than 0.5 (is 0.7)",
    ]


def test_numbers_may_be_of_any_kind(square: hvi.Body) -> None:
    """NumPy's are no Python floats, and its arrays no lists."""
    diagonal = hvi.Model(square, [hvi.Anisotropic(matrix=np.diag(np.float32([2, 2, 1])))])  # type: ignore[arg-type]
    single = hvi.Model(square, [hvi.Isotropic(youngs_modulus=np.float32(2), poisson_ratio=np.array(0.0))])  # type: ignore[arg-type]
    plain = hvi.Model(square, [hvi.Isotropic(youngs_modulus=2.0, poisson_ratio=0.0)])
    assert single == plain
    assert hvi.Model(square, [hvi.Anisotropic(matrix=[[2, 0, 0], [0, 2, 0], [0, 0, 1]])]) == diagonal


@pytest.mark.parametrize("effects", [None, 3])
def test_effects_that_are_no_list_are_refused(square: hvi.Body, effects: Any) -> None:
    with pytest.raises(hvi.InputError, match="effects are a list"):
        hvi.Model(square, effects)


def test_a_list_where_a_replacement_stands_is_refused(square: hvi.Body) -> None:
    with pytest.raises(hvi.InputError, match=r"^replace: .* is no effect with a place"):
        hvi.Model(square, [STEEL]).replace([STEEL])  # type: ignore[arg-type]


def test_effects_may_come_one_by_one(square: hvi.Body) -> None:
    """A generator can be read once only."""
    assert len(hvi.Model(square, (one for one in [STEEL])).effects) == 1  # type: ignore[arg-type]


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


def test_a_component_of_a_function_may_be_one_number(square: hvi.Body) -> None:
    pulled = solved(square, lambda x: [1e6 * (1 + x[1]), 0.0])
    np.testing.assert_allclose(pulled.resultant("right"), [1.5e6, 0.0], atol=1e-6)


@pytest.mark.parametrize("true", [True, np.True_, np.array(True)])
@pytest.mark.parametrize(
    "effect",
    [
        lambda true: hvi.Isotropic(youngs_modulus=true, poisson_ratio=0.3),
        lambda true: hvi.Isotropic(youngs_modulus=1e9, poisson_ratio=0.3, thermal_expansion=true),
        lambda true: hvi.Orthotropic(youngs_moduli=[1.0, true], poisson_ratios=[0.0], shear_moduli=[1.0]),
        lambda true: hvi.Anisotropic(matrix=[[2, 0, 0], [0, true, 0], [0, 0, 1]]),
        lambda true: hvi.Displacement("left", [true, 0.0]),
        lambda true: hvi.Traction("right", [true, 0.0]),
        lambda true: hvi.Pressure("right", true),
        lambda true: hvi.Force("right", [true, 0.0]),
        lambda true: hvi.Moment("right", true),
        lambda true: hvi.BodyForce([true, 0.0]),
        lambda true: hvi.Temperature(true),
        lambda true: hvi.Contact("bottom", gap=true),
        lambda true: hvi.Contact("bottom", direction=[true, 1.0]),
        lambda true: hvi.Contact("bottom", obstacle=([0.0, 0.0], [true, 1.0])),
        lambda true: hvi.Contact("bottom", obstacle={"shape": "sphere", "center": [0.0, -1.0], "radius": true}),
        lambda true: hvi.Contact("bottom", obstacle={"point": [0, true], "normal": [0, 1]}),
        lambda true: hvi.Friction("bottom", hvi.laws.Tresca(1.0), multiplier=true),
        lambda true: hvi.Cohesion("bottom", hvi.laws.Tresca(1.0), beta=true),
    ],
)
def test_a_boolean_is_no_number(square: hvi.Body, effect: Any, true: Any) -> None:
    """Python counts True as 1, and so it was taken."""
    with pytest.raises(hvi.InputError, match=r"must be .*number.*|must be greater than|usable|numbers only"):
        modelled(square, effect(true))


@pytest.mark.parametrize(
    "made",
    [
        lambda: hvi.Body.rectangle([True, 1.0], [2, 2]),
        lambda: hvi.Body.rectangle([1.0, 1.0], [2, True]),
        lambda: hvi.Body.box([1.0, 1.0, 1.0], np.array([True, True, True])),  # type: ignore[arg-type]
        lambda: hvi.Body.file(__file__, scale=True),
        lambda: hvi.Body.file(__file__, refinements=True),
        lambda: hvi.Body.file(__file__, dimension=True),
        lambda: hvi.laws.QuadraticLinear(gamma1=2.0, gamma2=True, delta=1e-6),
        lambda: hvi.laws.Graph([(0, 0), (True, 1.0)]),
        lambda: hvi.laws.PowerLaw(energy_ratio=True, exponent=2.0),
        lambda: hvi.read_tables({"domain": {"shape": "rectangle", "size": [1.0, True], "cells": [2, 2]}}),
    ],
)
def test_a_boolean_is_no_number_of_a_body_or_a_law(made: Any) -> None:
    with pytest.raises(hvi.InputError, match=r"number|must be 2 or 3"):
        made()


@pytest.mark.parametrize(
    "options",
    [{"tolerance": True}, {"max_iterations": True}, {"epsilon": True}, {"start": [True, 0.0]}, {"degree": True}],
)
def test_a_boolean_is_no_option(square: hvi.Body, options: Any) -> None:
    with pytest.raises(hvi.InputError, match=r"must be .*is true|must be a number .*not true"):
        hvi.check(hvi.Model(square, [STEEL, hvi.Displacement("left", [0.0, 0.0])]), **options)


def test_options_may_be_numbers_of_numpy(square: hvi.Body) -> None:
    model = hvi.Model(square, [STEEL, hvi.Displacement("left", [0.0, 0.0])])
    plain, given = hvi.check(model, max_iterations=7), hvi.check(model, max_iterations=np.int64(7))  # type: ignore[arg-type]
    assert plain.scene == given.scene


@pytest.mark.parametrize(
    ("argument", "named"),
    [({"gap": "1e-3"}, "gap"), ({"limit": True}, "limit"), ({"limit": -1}, "limit"), ({"gap": 10**400}, "gap")],
)
def test_a_search_names_its_wrong_argument(square: hvi.Body, argument: Any, named: str) -> None:
    with pytest.raises(hvi.InputError, match=f"^{named}: must be a number"):
        hvi.equilibria(hvi.Model(square, [STEEL]), **argument)


@pytest.mark.parametrize("points", [3, [1, 2], "graph", [(0, 0), 1.0]])
def test_a_graph_of_other_things_than_pairs_is_refused(points: Any) -> None:
    """Some of them raised a bare TypeError."""
    with pytest.raises(hvi.InputError, match=r"pairs? .displacement, traction"):
        hvi.laws.Graph(points)


def test_a_contradiction_names_effects_and_places(square: hvi.Body) -> None:
    with pytest.raises(hvi.InputError) as refused:
        hvi.Model(square, [STEEL, hvi.Displacement("bottom", [None, 0.0]), hvi.Contact("bottom")])
    assert str(refused.value) == (
        'boundary.bottom.contact: the displacement normal to "bottom" is prescribed by boundary.bottom.displacement; '
        'leave contact out or write "free" there'
    )


def test_what_the_mesh_shows_names_effects_too(square: hvi.Body) -> None:
    """A piece shares facets with the whole side."""
    body = square.piece("lower", "bottom", "x < 0.6")
    with pytest.raises(
        hvi.InputError,
        match=r"^boundary\.\w+\.contact: shares facets with boundary\.(bottom|lower), which has",
    ):
        hvi.check(hvi.Model(body, [STEEL, hvi.Contact("bottom"), hvi.Contact("lower")]))


@pytest.mark.parametrize(
    ("made", "reason"),
    [
        (lambda body: body.piece(3, "left", "y > 0.5"), "^piece: the name must be a text .is 3"),
        (lambda body: body.interface([], "right", "left"), "^interface: the name must be a text"),
        (
            lambda body: body.interface("i", "right", "left", tied="no"),
            "^interface: tied must be True or False .is 'no'",
        ),
        (lambda body: hvi.equilibria(hvi.Model(body, [STEEL]), lowest="no"), "^lowest: must be True or False"),
        (lambda body: hvi.laws.Tresca(10**400), "yield_traction = 1000.* is not usable; give a finite number"),
        (
            lambda body: hvi.follow(hvi.Model(body, [STEEL]), to=10**400),
            "^to.0: must be ",
        ),
        (lambda body: hvi.study(hvi.Model(body, [STEEL]), mesh=[10**400]), "is no number of cells along x"),
        (lambda body: hvi.study(hvi.Model(body, [STEEL]), mesh=["\u00b2"]), "is no number of cells along x"),
    ],
)
def test_what_was_taken_in_silence_or_raised_no_words_is_refused(square: hvi.Body, made: Any, reason: str) -> None:
    """The text "no" counted as True, and some of these raised a bare TypeError, OverflowError or ValueError."""
    with pytest.raises(hvi.InputError, match=reason):
        made(square)


@pytest.mark.parametrize(
    ("made", "reason"),
    [
        (lambda model: hvi.read_scene(3), "^path: must be a path.* .is 3"),  # type: ignore[arg-type]
        (lambda model: hvi.study(model, True), "^folder: must be a path.* .is True"),
        (lambda model: hvi.set_log_level(None), "^log level: must be a name.* .is None"),  # type: ignore[arg-type]
        (lambda model: hvi.solve(model, estimate=False).write(True), "^folder: must be a path.* .is True"),
        (lambda model: hvi.solve(model, estimate=False).plot([1.0]), "^picture: must be the name.* .is .1.0"),
    ],
)
def test_a_value_of_another_kind_is_refused_in_words(square: hvi.Body, made: Any, reason: str) -> None:
    """They raised a bare TypeError or AttributeError."""
    with pytest.raises(hvi.InputError, match=reason):
        made(hvi.Model(square, [STEEL, hvi.Displacement("left", [0.0, 0.0]), hvi.Traction("right", [1e6, 0.0])]))

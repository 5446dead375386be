"""Models from Python: an own mesh gives what the scene file gives, whatever the loads are written as; SI throughout."""

from __future__ import annotations

import functools
import inspect
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from own_mesh import LAW, STEEL, TAGS, own_square, steel_square, tagged_square
from runs import on_ranks
from scenes import model as scene_table
from scenes import quadratic_linear

import hvi_fenicsx as hvi
from hvi_fenicsx.report.pictures import shape
from hvi_fenicsx.report.pictures.shape import regions
from hvi_fenicsx.report.reader import Result
from hvi_fenicsx.results import gathering
from hvi_fenicsx.results.summary import summary

E, NU = 2.15e11, 0.29


@pytest.fixture(scope="module")
def body() -> hvi.Body:
    return own_square()


@pytest.fixture(scope="module")
def found(body: hvi.Body) -> hvi.Solution:
    return hvi.solve(steel_square(body=body))


def strain(v: Any) -> Any:
    return ufl.sym(ufl.grad(v))


def plane_stress(u: Any, v: Any) -> Any:
    trace, shear = E * NU / (1 - NU**2), E / (1 + NU)
    sigma = trace * ufl.tr(strain(u)) * ufl.Identity(2) + shear * strain(u)
    return ufl.inner(sigma, strain(v)) * ufl.dx


def test_an_own_mesh_gives_what_the_scene_gives(found: hvi.Solution) -> None:
    scene = hvi.read_tables(scene_table(8, 3e6, friction=quadratic_linear(1e6)))
    same = hvi.solve(scene, MPI.COMM_SELF)
    assert found.converged
    assert same.converged
    assert found.energy == pytest.approx(same.energy, rel=1e-12)
    ours, theirs = found.contact["floor"], same.contact["floor"]
    np.testing.assert_allclose(ours.slip, theirs.slip, rtol=1e-10)
    np.testing.assert_allclose(ours.pressure, theirs.pressure, rtol=1e-9)
    np.testing.assert_array_equal(ours.branch, theirs.branch)  # type: ignore[arg-type]


def test_fields_are_in_si_on_the_users_mesh() -> None:
    """Without friction the paper's problem has a closed form: uniform stress, linear displacement."""
    square, tags = tagged_square(MPI.COMM_SELF, 3)
    frictionless = [
        STEEL,
        hvi.Displacement("wall", [0.0, None]),
        hvi.Traction("pull", [1e6, 0.0]),
        hvi.Traction("press", [0.0, -1e6]),
        hvi.Contact("floor"),
    ]
    exact = hvi.solve(hvi.Model(hvi.Body(square, tags, names=TAGS), frictionless))
    assert exact.u.function_space.mesh is square
    x = exact.u.function_space.tabulate_dof_coordinates()
    u = exact.u.x.array.reshape(-1, 2)
    np.testing.assert_allclose(u, (1 + NU) * 1e6 / E * x[:, :2] * [1, -1], atol=1e-16)
    np.testing.assert_allclose(exact.stress.x.array.reshape(-1, 3, 3), [np.diag([1e6, -1e6, 0.0])] * 18, atol=1e-5)
    assert exact.energy == pytest.approx(-(1 + NU) * 1e12 / E, rel=1e-10)
    np.testing.assert_allclose(exact.contact["floor"].pressure, 1e6, rtol=1e-9)
    work = fem.assemble_scalar(fem.form(0.5 * ufl.inner(exact.stress, pad(strain(exact.u))) * ufl.dx))
    assert work == pytest.approx(-exact.energy, rel=1e-10)  # UFL on the solution is in SI


def pad(tensor: Any) -> Any:
    return ufl.as_tensor([[tensor[i, j] if max(i, j) < 2 else 0 for j in range(3)] for i in range(3)])


def test_all_that_acts_on_the_body_is_in_balance(found: hvi.Solution) -> None:
    np.testing.assert_allclose(found.resultant("pull"), [3e6, 0.0], atol=1e-3)
    np.testing.assert_allclose(found.resultant("floor")[1], 1e6, rtol=1e-9)
    np.testing.assert_allclose(np.sum(list(found.resultants.values()), axis=0), 0.0, atol=1e-2)
    floor = found.contact["floor"]
    assert found.resultant("floor")[0] == pytest.approx(-np.sum(floor.weight * floor.friction), rel=1e-9)
    with pytest.raises(hvi.InputError, match="nothing acts on 'roof'; there are: pull, press, floor, wall"):
        found.resultant("roof")


def test_a_load_may_be_a_formula_a_function_or_ufl(body: hvi.Body) -> None:
    x = ufl.SpatialCoordinate(body.mesh)
    field = fem.Function(fem.functionspace(body.mesh, ("Lagrange", 1)))
    field.interpolate(lambda x: -1e6 * (1 + x[0]))
    ways = [
        [0.0, "-1e6*(1 + x)"],
        [0.0, lambda x: -1e6 * (1 + x[0])],
        lambda x: np.stack([0 * x[0], -1e6 * (1 + x[0])]),
        [0.0, -1e6 * (1 + x[0])],
        ufl.as_vector([0.0, -1e6 * (1 + x[0])]),
        [0.0, field],
    ]
    found = [hvi.solve(steel_square(body=body, press=press), estimate=False) for press in ways]
    others = [one for one in steel_square(body=body).effects if one.where != ("press",)]
    found.append(hvi.solve(hvi.Model(body, [*others, hvi.Pressure("press", 1e6 * (1 + x[0]))]), estimate=False))
    for solution in found:
        assert solution.energy == pytest.approx(found[0].energy, rel=1e-11)
        shown = {load.side.part: load for load in shape.loaded_sides(as_read(solution))}
        at = solution.problem.points[shown["press"].side.vertices]  # on one rank vertices are numbered alike
        np.testing.assert_allclose(shown["press"].traction[:, 1], -1e6 * (1 + at[:, 0]), rtol=1e-9)
        np.testing.assert_allclose(shown["press"].traction[:, [0, 2]], 0.0, atol=1e-6)
        np.testing.assert_allclose(shown["pull"].traction, np.tile([3e6, 0, 0], (9, 1)))


def as_read(solution: hvi.Solution) -> Result:
    """A solution as pictures read it from its folder."""
    arrays = gathering.solution_arrays(solution)
    assert arrays is not None
    return Result(folder=Path("."), scene={}, summary=summary(solution), arrays=arrays)


def test_gaps_and_prescribed_values_may_be_functions(body: hvi.Body) -> None:
    x = ufl.SpatialCoordinate(body.mesh)
    ways: list[tuple[Any, Any]] = [("1e-6*x", "-1e-6*y"), (lambda x: 1e-6 * x[0], -1e-6 * x[1])]
    found = []
    for gap, wall in ways:
        changes = hvi.Contact("floor", gap=gap), hvi.Displacement("wall", [wall, None])
        found.append(hvi.solve(steel_square(body=body).replace(*changes)))
        assert found[-1].converged
    np.testing.assert_allclose(found[1].u.x.array, found[0].u.x.array, atol=1e-16)
    floor = found[0].contact["floor"]
    np.testing.assert_allclose(floor.gap + floor.displacement, 1e-6 * floor.x[:, 0], atol=1e-18)


def test_an_own_energy_equal_to_the_built_in_one_gives_the_same(body: hvi.Body, found: hvi.Solution) -> None:
    own = hvi.solve(steel_square(body=body, material=hvi.Energy(plane_stress)))
    assert own.converged
    assert own.energy == pytest.approx(found.energy, rel=1e-12)
    np.testing.assert_allclose(own.u.x.array, found.u.x.array, rtol=0, atol=1e-12 * np.max(np.abs(found.u.x.array)))
    np.testing.assert_allclose(own.stress.x.array, found.stress.x.array, rtol=0, atol=1e-4)


@pytest.mark.parametrize(
    ("form", "reason"),
    [
        (lambda u, v: ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx, "a rigid motion costs energy"),
        (lambda u, v: ufl.inner(u, v) * ufl.dx, "a rigid motion costs energy"),
        (lambda u, v: u[0].dx(0) * v[1].dx(0) * ufl.dx, "not symmetric"),
        (lambda u, v: u[0].dx(0) * v[0].dx(0) * ufl.dx, "a stretch along y costs no energy"),
        (lambda u, v: ufl.inner(u, v), "must return a bilinear UFL form"),
    ],
)
def test_a_form_that_is_no_elasticity_is_refused_with_the_reason(body: hvi.Body, form: Any, reason: str) -> None:
    with pytest.raises(hvi.InputError, match=reason):
        steel_square(body=body, material=hvi.Energy(form))


def test_regions_by_tags_of_cells(body: hvi.Body) -> None:
    """A soft half: the same by tags as by formulas in an own energy."""
    square, tags = tagged_square(MPI.COMM_SELF)
    cells = np.arange(square.topology.index_map(2).size_local, dtype=np.int32)
    right = mesh.compute_midpoints(square, 2, cells)[:, 0] > 0.5
    halves = mesh.meshtags(square, 2, cells, np.where(right, 12, 11).astype(np.int32))
    two = hvi.Body(square, tags, halves, names=TAGS, regions={"hard": 11, "soft": 12})
    assert two.regions == ("hard", "soft")
    materials = [
        hvi.Isotropic(youngs_modulus=E, poisson_ratio=NU, region="hard"),
        hvi.Isotropic(youngs_modulus=E / 4, poisson_ratio=NU, region="soft"),
    ]
    loads = [one for one in steel_square(body=two).effects if one.where is not None]
    by_tags = hvi.solve(hvi.Model(two, [*materials, *loads]))

    def graded(u: Any, v: Any) -> Any:
        x = ufl.SpatialCoordinate(body.mesh)
        return ufl.conditional(ufl.gt(x[0], 0.5), 0.25, 1.0) * plane_stress(u, v).integrals()[0].integrand() * ufl.dx

    by_formula = hvi.solve(steel_square(body=body, material=hvi.Energy(graded)))
    assert by_tags.energy == pytest.approx(by_formula.energy, rel=1e-10)
    shown = {region.name: region.cells for region in regions(as_read(by_tags))}
    assert {name: set(numbers) for name, numbers in shown.items()} == {
        "hard": set(cells[~right]),
        "soft": set(cells[right]),
    }


def test_what_is_wrong_with_a_mesh_or_its_tags_is_said() -> None:
    square, tags = tagged_square(MPI.COMM_SELF, 2)
    inner = mesh.meshtags(square, 1, np.arange(16, dtype=np.int32), np.full(16, 7, dtype=np.int32))
    boxes = mesh.create_unit_square(MPI.COMM_SELF, 2, 2, mesh.CellType.quadrilateral)
    wrong: list[tuple[Any, str]] = [
        (lambda: hvi.Body(boxes), "cells of the kind quadrilateral; .* CellType.triangle"),
        (lambda: hvi.Body(square, tags, names={"roof": 9}), "'roof' is the tag 9 of facets, .* there are: 1, 2, 3, 4"),
        (lambda: hvi.Body(mesh.create_unit_square(MPI.COMM_SELF, 2, 2), tags, names=TAGS), "tags of another mesh"),
        (lambda: hvi.Body(square, inner, names={"all": 7}), "'all' has facets inside of the body"),
        (lambda: hvi.Body(square, names={"wall": 1}), "'wall' is a side, but no tags of facets are given"),
        (lambda: hvi.Body(square, cells=tags, regions={"steel": 1}), "cells are tags of dimension 1"),
        (lambda: hvi.Body(square, np.array([1, 2])), "facets are of the kind ndarray; give dolfinx.mesh.MeshTags"),
        (lambda: hvi.Body(square, tags, names=["wall"]), r'names are numbers of tags by name, .*"wall": 1'),  # type: ignore[arg-type]
    ]
    for make, reason in wrong:
        with pytest.raises(hvi.InputError, match=reason):
            make()


def test_wrong_words_are_refused_as_in_a_scene_file(body: hvi.Body) -> None:
    wrong: list[tuple[Any, str]] = [
        (lambda: hvi.Model(body, [STEEL, hvi.Traction("pul", [0, 0])]), 'unknown place "pul"; did you mean "pull"'),
        (
            lambda: hvi.Model(body, [STEEL, hvi.Traction("pull", [0.0])]),
            "^Traction on pull: traction has 1 components; in 2D it has 2",
        ),
        (lambda: hvi.Model(body, [hvi.Traction("pull", [0.0, 0.0])]), "no effect is a material; add one"),
        (lambda: hvi.Model(body, [hvi.Isotropic(youngs_modulus=-1, poisson_ratio=0.3)]), "youngs_modulus|greater"),
        (lambda: hvi.solve(steel_square(body=body), tolerence=1), 'unknown key "tolerence"; did you mean "tolerance"'),
        (lambda: hvi.Body.rectangle([1.0, -1.0], [2, 2]), r"size\.1: must be 1e-09 or more"),
        (lambda: hvi.Body.rectangle([1.0, 1.0], 8), r"cells: must be a list of 2, .*is 8"),  # type: ignore[arg-type]
        (lambda: hvi.Body("part.msh"), r"is no dolfinx mesh; a file is read by hvi.Body.file"),  # type: ignore[arg-type]
        (lambda: hvi.Model(body.mesh, [STEEL]), r"is no body; make one of a mesh"),  # type: ignore[arg-type]
        (lambda: hvi.Model(body, STEEL), "effects are a list"),  # type: ignore[arg-type]
        (lambda: hvi.Model(body, [STEEL, LAW]), "QuadraticLinear.* is no effect with a place"),  # type: ignore[list-item]
        (
            lambda: hvi.solve(steel_square(body=body), petsc={"ksp_max_itt": 5}),
            "petsc: no solver of this run has read ksp_max_itt",
        ),
        (lambda: hvi.solve(steel_square(body=body), petsc={"pc_type": "luu"}), "-hvi_pc_type luu: .*PC type luu"),
        (lambda: hvi.read_tables({"domain": {"shape": "rectangel"}}), 'domain.shape: unknown .*mean "rectangle"'),
        (lambda: hvi.solve("part.toml"), "'part.toml' is no model; a scene file is read by"),  # type: ignore[arg-type]
    ]
    for make, reason in wrong:
        with pytest.raises(hvi.InputError, match=reason):
            make()


def test_a_body_that_escapes_has_no_displacement_and_says_so(body: hvi.Body) -> None:
    lifted = steel_square(body=body).replace(hvi.Traction("press", [0.0, 1e6]))
    gone = hvi.solve(lifted)
    assert not gone.converged
    assert "no solution exists" in repr(gone)
    assert hvi.check(lifted).solvability.state == "escapes"
    for wanted in ("u", "stress", "energy", "contact"):
        with pytest.raises(hvi.InputError, match=r"nothing was solved.*translation along \+y"):
            getattr(gone, wanted)
    assert gone.plot() is not None  # the escape


def test_it_is_short_to_read_and_can_be_seen(found: hvi.Solution) -> None:
    assert repr(found).startswith("result: certified")
    assert repr(found.certificate).startswith("Certificate(passed at 1e-08: equilibrium ")
    assert repr(found.estimate).startswith("Estimate(relative=0.")
    prepared = repr(hvi.check(steel_square())).splitlines()
    assert prepared[0] == "untitled: 162 unknowns on 1 rank"
    assert prepared[1].startswith("existence: held")
    with pytest.raises(KeyError, match="no contact and no law acts on 'wall'; there are: floor"):
        found.contact["wall"]
    figure = found.plot("stress")
    assert figure is not None
    assert figure._repr_png_()[:4] == b"\x89PNG"  # type: ignore[attr-defined]
    with pytest.raises(hvi.InputError, match="no picture 'sketch' of this solution; there are: body"):
        found.plot("sketch")


@pytest.mark.parametrize("kind", [hvi, hvi.Body, hvi.Model, hvi.Solution])
def test_calls_and_properties_say_whether_they_are_collective(kind: Any) -> None:
    every = [(n, getattr(kind, n)) for n in (hvi.__all__ if kind is hvi else dir(kind)) if not n.startswith("_")]
    calls = [(n, c) for n, c in every if inspect.isroutine(c) or isinstance(c, (property, functools.cached_property))]
    assert calls
    silent = [n for n, call in calls if "collective" not in call.__doc__.lower()]
    assert not silent


def test_the_slip_of_a_part_turns_with_its_tangents() -> None:
    """A block moved sideways slips as it is moved, whatever the tangents are."""
    box = hvi.Body.box([1.0, 1.0, 1.0], [1, 1, 1], MPI.COMM_SELF)
    whole = [hvi.Isotropic(youngs_modulus=E, poisson_ratio=NU), hvi.Displacement("top", [1e-5, 2e-5, 0.0])]
    floor = hvi.solve(hvi.Model(box, [*whole, hvi.Contact("bottom")])).contact["bottom"]
    assert floor.friction.shape == (4, 2)
    assert np.isnan(floor.friction).all()  # no law: the shear there is a support's
    slip = np.einsum("mk,mkd->md", floor.slip, floor.tangents)
    np.testing.assert_allclose(slip, np.tile([1e-5, 2e-5, 0.0], (4, 1)), atol=1e-18)


def test_a_solution_writes_the_folder_of_a_run(found: hvi.Solution, tmp_path: Path) -> None:
    folder = tmp_path / "strong"
    found.write(folder, pictures=False)
    kept = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert kept["energy"] == pytest.approx(found.energy, rel=1e-14)
    assert {"contact.csv", "displacement.pvd", "report.html", "scene.toml"} < {f.name for f in folder.iterdir()}
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "made by a Python program" in page
    with pytest.raises(hvi.InputError, match=r"already holds a result; .*force=True in Python"):
        found.write(folder)
    found.write(folder, force=True, pictures=False)


@pytest.mark.long
def test_the_ranks_of_any_communicator_tell_the_same(found: hvi.Solution) -> None:
    everywhere = on_ranks(2, str(Path(__file__).parent / "own_mesh_ranks.py"))
    alone = hvi.solve(steel_square(MPI.COMM_SELF), tolerance=1e-12)
    assert [rank["drawn"] for rank in everywhere] == [True, False]
    for rank in everywhere:
        assert rank["energy"] == pytest.approx(alone.energy, rel=1e-11)
        np.testing.assert_allclose(rank["pressure"], alone.contact["floor"].pressure, rtol=1e-8)
        for part in ("floor", "wall"):
            np.testing.assert_allclose(rank[part], alone.resultant(part), rtol=1e-8, atol=1e-2)


@pytest.mark.parametrize(
    "other",
    [
        hvi.Displacement("wall", [0.0, 0.0]),
        hvi.Displacement("wall", [-1e-6, None]),
        hvi.Friction("floor", hvi.laws.QuadraticLinear(gamma1=2e6, gamma2=1e6, delta=9e-6)),
        hvi.Contact("floor", gap=1e-6),
        hvi.Traction("pull", [1e6, "2e5*y"]),
    ],
)
def test_what_a_body_keeps_is_that_of_the_model(body: hvi.Body, other: Any) -> None:
    """Supports, laws, gaps and loads change between two solves of one body; a body of its own gives the same."""
    hvi.solve(steel_square(body=body), estimate=False)
    kept = hvi.solve(steel_square(body=body).replace(other))
    alone = hvi.solve(steel_square(body=own_square()).replace(other))
    assert kept.energy == pytest.approx(alone.energy, rel=1e-12)
    assert kept.estimate.relative == pytest.approx(alone.estimate.relative, rel=1e-8)
    np.testing.assert_allclose(kept.u.x.array, alone.u.x.array, atol=1e-11 * np.abs(alone.u.x.array).max())


def test_a_loop_over_loads_may_begin_at_the_last_solution(body: hvi.Body) -> None:
    """The load that has gone beyond the drop and comes back: the start decides which of two equilibria is found."""
    pulls = [2e6, 3.5e6, 2e6]
    found: list[hvi.Solution] = []
    for pull in pulls:
        model = steel_square(body=body).replace(hvi.Traction("pull", [pull, 0.0]))
        found.append(hvi.solve(model, start=found[-1] if found else None, estimate=False))
    assert all(one.converged and one.estimate is None for one in found)
    assert found[2].energy == pytest.approx(found[0].energy, rel=1e-10)  # without memory the joint heals
    with pytest.raises(hvi.InputError, match="start: is a solution on another mesh"):
        hvi.solve(steel_square(), start=found[0])

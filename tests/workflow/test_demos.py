"""Every demo says in its header what to expect: here it is held to it, by statics, closed forms and conservation laws.

A demo that nobody checks drifts from its own text, and readers copy demos first.
"""

from __future__ import annotations

import functools

import numpy as np
import numpy.typing as npt
import pytest
from runs import ROOT
from scenes import displacement, energy, points
from scipy.sparse import csc_matrix, csr_matrix, diags
from scipy.sparse.linalg import spsolve

from hvi_fenicsx import Solution, prepare, read_scene, read_tables, solve
from hvi_fenicsx.certify.contact_state import ContactState

Array = npt.NDArray[np.float64]
DEMOS = ROOT / "demos"
ESCAPES = 3


@functools.cache
def demo(name: str, *overrides: str) -> Solution:
    return solve(read_scene(DEMOS / f"{name}.toml", list(overrides)))


def state(solution: Solution, part: str) -> ContactState:
    assert solution.exit_code == 0
    assert solution.examination is not None
    return next(s for s in solution.examination.states if s.surface.part == part)


def mean(where: ContactState, values: Array) -> Array:
    """The mean of nodal values over a part."""
    weights = where.surface.weights
    return np.asarray(weights @ values / weights.sum())


@pytest.mark.parametrize("name", sorted(p.stem for p in DEMOS.glob("*.toml")))
def test_every_demo_is_read_and_says_what_it_shows(name: str) -> None:
    text = (DEMOS / f"{name}.toml").read_text(encoding="utf-8")
    assert text.startswith("# ")
    assert read_scene(DEMOS / f"{name}.toml").title


def test_the_pushed_block_sticks_with_the_slip_that_its_friction_needs() -> None:
    found = demo("pushed_block")
    floor = state(found, "floor")
    assert found.solvability.state == "metastable"
    slip = mean(floor, floor.slip)[0] * found.problem.scales.displacement
    assert slip == pytest.approx(0.6e6 * 9e-6 / 1e6, rel=1e-9)


def test_the_tower_tips_about_its_front_edge() -> None:
    """Weight times b/2 over wind times h/2."""
    assert state(demo("tipping_tower"), "floor").contact.any()
    found = prepare(read_scene(DEMOS / "tipping_tower.toml")).load_factors("wind")
    assert found.held == pytest.approx(1e5 * 0.5 / (2e4 * 2.0), rel=1e-8)
    tipped = demo("tipping_tower", "boundary.wind.traction=[6.3e3, 0]")
    assert tipped.exit_code == ESCAPES
    assert tipped.solvability.direction is not None
    assert "rotation about (1, 0), clockwise" in tipped.solvability.direction.name


def test_the_lifted_floor_bears_the_press_and_drags_where_it_has_lifted() -> None:
    found = demo("lift_off")
    floor, p = state(found, "floor"), found.problem.scales.stress
    lifted = floor.gap * found.problem.scales.displacement > 1e-12
    assert np.count_nonzero(lifted) == 10
    assert mean(floor, -floor.pressure) * p == pytest.approx(1e6, rel=1e-9)
    wanted = 3e6 / 9e-6 * floor.slip[lifted, 0] * found.problem.scales.displacement
    assert wanted.max() > 1e5
    np.testing.assert_allclose(floor.friction[lifted, 0] * p, wanted, rtol=1e-7)


def test_the_block_in_the_slot_rises_to_its_upper_side_and_stretches() -> None:
    found = demo("slot")
    u2 = 2e-6 + 1e6 * (1 - 0.29**2) / 2.15e11 * points(found)[:, 1]
    np.testing.assert_allclose(displacement(found)[:, 1], u2, rtol=1e-9)
    sunk = demo("slot", "boundary.pull.traction=[0, -1e6]")
    assert displacement(sunk)[:, 1].max() == pytest.approx(-1e-6, rel=1e-9)


def test_the_slender_bar_has_the_stress_of_a_slender_bar() -> None:
    found = demo("thermal_bar")
    stop = state(found, "stop")
    grown = (23e-6 * 0.4 + 12e-6 * 0.6) * 60
    stress = (grown - 0.5e-3) / (0.4 / 7e10 + 0.6 / 2.1e11)
    assert mean(stop, -stop.pressure) * found.problem.scales.stress == pytest.approx(stress, rel=5e-3)
    free = demo("thermal_bar", "body.temperature=30.0")
    assert not state(free, "stop").contact.any()
    assert displacement(free)[:, 0].max() == pytest.approx(grown / 2, rel=1e-2)


def hertz(*overrides: str) -> tuple[float, float]:
    """Largest pressure and half-width of the ellipse that fits the computed pressures, over Hertz's."""
    found = demo("hertz", *overrides)
    floor = state(found, "floor")
    x, p = floor.surface.points[:, 0], -floor.pressure * found.problem.scales.stress
    width = np.sqrt(4 * 4e3 * 0.1 * (1 - 0.3**2) / (np.pi * 1e7))
    largest = 2 * 4e3 / (np.pi * width)
    inside = p > 0.3 * largest
    slope, top = np.polyfit(x[inside] ** 2, p[inside] ** 2, 1)
    return float(np.sqrt(top) / largest), float(np.sqrt(-top / slope) / width)


def test_hertz_pressure_and_half_width_converge() -> None:
    """With 7, 14 and 28 cells to a half-width; what remains is that the disk is no half-space."""
    sizes = [1e-3, 0.5e-3, 0.25e-3]
    found = [hertz(f"domain.mesh_size_below={h}", f"domain.mesh_size={20 * h}") for h in sizes]
    errors = [max(abs(p - 1), abs(a - 1)) for p, a in found]
    assert errors[0] < 0.04
    assert errors[-1] < 3e-3
    assert np.log2(errors[0] / errors[-1]) / 2 > 1.0


def test_the_peeled_strip_obeys_the_j_integral() -> None:
    """F θ, as the work of the end's tractions on ∂u2/∂x, is the glue's fracture energy (Rice 1968)."""
    found = demo("peeling")
    assert found.examination is not None
    glue, x, u = state(found, "glue"), points(found), displacement(found)
    force = found.examination.forces.reaction[:, 1] * found.problem.scales.force
    end = np.flatnonzero(x[:, 0] < 1e-9)
    beside = [int(np.argmin(np.hypot(x[:, 0] - 1e-3, x[:, 1] - x[i, 1]))) for i in end]
    slope = -(u[beside, 1] - u[end, 1]) / 1e-3
    assert float(force[end] @ slope) == pytest.approx(0.5 * 5e6 * 20e-6, rel=0.01)
    opening = -glue.normal * found.problem.scales.displacement
    assert glue.surface.points[opening > 20e-6, 0].max() == pytest.approx(0.084, abs=1.5e-3)


def test_the_3d_block_slips_along_its_load() -> None:
    found = demo("block_3d")
    wall = state(found, "wall")
    slip = mean(wall, wall.slip) * found.problem.scales.displacement
    along = wall.surface.tangents[0] @ np.array([0.0, 1e4, -2.5e4])
    np.testing.assert_allclose(slip, along * 1e-4 / 4e4, rtol=1e-9)
    assert found.solvability.lambda_held == pytest.approx(2e4 / np.hypot(1e4, 2.5e4), rel=1e-8)
    assert found.solvability.lambda_peak == pytest.approx(4e4 / np.hypot(1e4, 2.5e4), rel=1e-8)


def test_the_anchor_opens_as_far_as_its_pull_needs() -> None:
    found = demo("anchor_3d")
    base = state(found, "base")
    opening = -base.normal * found.problem.scales.displacement
    assert mean(base, opening) == pytest.approx(24e3 * 20e-6 / (1e6 * 0.04), rel=1e-9)
    assert (opening.min(), opening.max()) == pytest.approx((8e-6, 16e-6), rel=0.02)
    assert found.solvability.lambda_held == pytest.approx(0.6, rel=1e-8)
    assert found.solvability.lambda_peak == pytest.approx(1.5, rel=1e-8)


def giving(broken: int) -> float:
    """The energy with so many vertices of the ground broken from the right, the others on springs: a linear system."""
    scene = demo("jureczka_ochal").scene.tables()
    del scene["boundary"]["ground"]
    ready = prepare(read_tables(scene))
    system, scales = ready.system, ready.problem.scales
    rows, columns, values = system.jacobian.matrix.getValuesCSR()
    place = ready.problem.space.tabulate_dof_coordinates()
    ground = np.flatnonzero(place[:, 1] == 0.0)
    ground = ground[np.argsort(place[ground, 0])]
    weights = np.full(33, 2.0 / 32)
    weights[[0, -1]] /= 2
    kept = slice(1, 33 - broken)  # the first vertex is held
    springs = np.zeros(system.load.size)
    springs[2 * ground[kept] + 1] = 20.0 * weights[kept] * scales.displacement**2 / scales.energy
    u = spsolve(csc_matrix(csr_matrix((values, columns, rows)) + diags(springs)), system.load.array)
    return float(-0.5 * system.load.array @ u) * scales.energy + 0.1 * float(weights[33 - broken :].sum())


@pytest.mark.parametrize(
    ("start", "broken", "wanted"),
    [('"unbroken"', 0, -0.2041), ('"broken"', 31, -0.9988), ('[0, "-1 if x > 1.8 else 0"]', 4, -0.1940)],
)
def test_the_giving_support_has_the_solutions_of_its_header(start: str, broken: int, wanted: float) -> None:
    """Each is the linear system of its own pieces of the law."""
    found = demo("jureczka_ochal", f"solver.start={start}")
    assert energy(found) == pytest.approx(giving(broken), rel=1e-8)
    assert energy(found) == pytest.approx(wanted, abs=1e-4)
    assert found.examination is not None
    assert found.examination.certificate.second_order == "local minimiser"
    sunk = state(found, "ground").normal * found.problem.scales.displacement > 0.1
    assert np.count_nonzero(sunk) == broken


def test_the_glue_of_the_lap_joint_carries_the_whole_pull() -> None:
    found = demo("single_lap")
    glue = state(found, "glue")
    scales = found.problem.scales
    carried = glue.surface.weights @ glue.friction[:, 0] * scales.force
    assert carried == pytest.approx(3.0e7 * 0.002, rel=1e-8)
    assert found.solvability.lambda_peak == pytest.approx(2e7 * 0.025 / (3.0e7 * 0.002), rel=1e-8)
    ends = np.argsort(glue.surface.points[:, 0])[[0, -1]]
    assert set(np.argsort(np.abs(glue.friction[:, 0]))[-2:]) == set(ends)


@pytest.mark.long
def test_the_glue_of_the_bracket_carries_force_and_moment() -> None:
    """The strength of the whole glue about the front edge of the foot, over the moment of the load about the plate."""
    found = demo("bracket_3d")
    glue, scales = state(found, "glue"), found.problem.scales
    traction = glue.pressure[:, None] * glue.surface.normals
    traction -= np.einsum("mk,mkd->md", glue.friction, glue.surface.tangents)
    forces = traction * glue.surface.weights[:, None] * scales.force
    assert forces.sum(axis=0) == pytest.approx([-600.0, 0.0, 0.0], abs=1e-5)
    moment = np.cross(glue.surface.points, forces).sum(axis=0)
    assert moment == pytest.approx([0.0, -600.0 * 0.05, 600.0 * 0.025], abs=1e-6)
    opened = glue.surface.points[np.argsort(glue.normal)[:10]]
    assert opened[:, 0].max() < 0.006
    assert found.solvability.lambda_peak == pytest.approx(1e7 * 0.03 * 0.04**2 / 2 / (600 * 0.05), rel=1e-8)


@pytest.mark.long
def test_the_fault_slips_as_a_crack_does() -> None:
    """Eshelby's crack in an infinite body; that of the demo is 20 times as wide as the crack's half."""
    found = demo("fault")
    fault = state(found, "fault")
    x, slip = fault.surface.points[:, 0] / 1e3, np.abs(fault.slip[:, 0]) * found.problem.scales.displacement
    crack = 4 * (1 - 0.25**2) * 1e7 * 1e3 / 5e10
    assert slip.max() == pytest.approx(crack, rel=0.01)
    inner = np.abs(x) < 0.98  # the vertices next to the tips carry the share of these too
    assert slip[inner] == pytest.approx(crack * np.sqrt(1 - x[inner] ** 2), abs=0.02 * crack)
    assert fault.friction[:, 0] * found.problem.scales.stress == pytest.approx(2e7, rel=1e-9)


def test_the_scarf_joint_has_the_strength_and_the_mixity_of_its_header() -> None:
    """The stress is uniform: the ellipse of the law decides."""
    found = demo("scarf_joint")
    glue, stress = state(found, "glue"), found.problem.scales.stress
    normal, along = 4.0e7 * np.sin(np.pi / 6) ** 2, 4.0e7 * np.sin(np.pi / 6) * np.cos(np.pi / 6)
    assert found.exit_code == 0
    assert found.solvability.lambda_peak == pytest.approx(3.0e7 / np.hypot(normal, along / 0.7), rel=1e-8)
    assert glue.pressure * stress == pytest.approx(normal, rel=1e-6)
    assert np.abs(glue.friction[:, 0]) * stress == pytest.approx(along, rel=1e-6)
    assert glue.of_both_modes is not None
    share = (along / 0.7) ** 2 / (normal**2 + (along / 0.7) ** 2)
    assert glue.of_both_modes.slip_share == pytest.approx(share, abs=1e-6)


@pytest.mark.parametrize("degree", [1, 2])
def test_two_cylinders_meet_with_the_pressure_of_hertz(degree: int) -> None:
    found = demo("two_cylinders", f"solver.degree={degree}")
    met, scales = state(found, "contact"), found.problem.scales
    force = float(met.surface.weights @ (met.pressure * met.surface.normals[:, 1])) * scales.force
    modulus, radius = 2.1e11 / (2 * (1 - 0.3**2)), 0.05
    peak = float(np.sqrt(force * modulus / (np.pi * radius)))
    assert -float(met.pressure.min()) * scales.stress == pytest.approx(peak, rel=1e-2)


@pytest.mark.long
def test_the_ball_presses_the_block_as_hertz_says() -> None:
    """Between force and largest pressure, whatever the depth; the model is a quarter."""
    found = demo("ball_on_block")
    top, scales = state(found, "top"), found.problem.scales
    force = -4 * float(top.surface.weights @ (top.pressure * top.surface.normals[:, 2])) * scales.force
    modulus = 1e7 / (1 - 0.3**2)
    peak = (6 * abs(force) * modulus**2 / np.pi**3) ** (1 / 3)
    assert -float(top.pressure.min()) * scales.stress == pytest.approx(peak, rel=0.01)

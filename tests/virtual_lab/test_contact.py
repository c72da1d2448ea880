"""The lab's laws and contact mechanics against derivatives, closed forms and balances."""

import numpy as np
import pytest
import yaml
from virtual_lab.block import block_mesh, graded_axis
from virtual_lab.contact import ContactProblem
from virtual_lab.indentation import contact_problem, grade_of, indent_object
from virtual_lab.material import LAWS, blatz_ko, neo_hookean, relaxed_force
from virtual_lab.obstacle import Sphere
from virtual_lab.shapes import Ball

R = 0.00622
E, NU = 25e3, 0.3
E_STAR = E / (1 - NU**2)
MATERIAL = {"law": "neo_hookean", "youngs_modulus_pa": E, "poisson_ratio": NU}
CONTACT = {"step_m": 0.001, "deepest_m": 0.003, "element_m": 0.002, "growth": 2.0}
CONTACT |= {"reach_m": 0.012, "friction": 0.0}


def quarter_block(height_m, element_m, depths_m, *, law=neo_hookean, friction=0.0, width_m=0.12):
    """Indent a wide bonded block, of which a quarter is solved; its mesh and load steps."""
    axis = graded_axis(0.0, width_m, 0.0, element_m, 1.9)
    levels = graded_axis(0.0, height_m, height_m, element_m, 1.9)
    *_, mesh = block_mesh(axis, axis, levels, reach_m=0.012, centre_m=np.zeros(2))
    fixed = np.zeros(mesh.nodes_m.shape, dtype=bool)
    fixed[mesh.nodes_m[:, 2] < 1e-9] = True
    for side in range(2):
        fixed[mesh.nodes_m[:, side] < 1e-9, side] = True
    sphere = Sphere(np.array([0, 0, height_m + R]), R, friction)
    problem = ContactProblem(mesh, law(E, NU), [sphere], stiffness_pa=E, fixed=fixed)
    return mesh, problem.indent(np.asarray(depths_m))


def forces_n(steps, share=4):
    """Force on the sphere."""
    return np.array([-share * step.forces_n[0, 2] for step in steps])


def bonded_layer(depths_m, height_m):
    """Hertz's force on a bonded layer, Eq. 11 of Dimitriadis et al. 2002."""
    a0 = -(1.2876 - 1.4678 * NU + 1.3442 * NU**2) / (1 - NU)
    b0 = (0.6387 - 1.0277 * NU + 1.5164 * NU**2) / (1 - NU)
    chi = np.sqrt(R * depths_m) / height_m
    factor = (
        1
        - 2 * a0 / np.pi * chi
        + 4 * a0**2 / np.pi**2 * chi**2
        - 8 / np.pi**3 * (a0**3 + 4 * np.pi**2 / 15 * b0) * chi**3
        + 16 * a0 / np.pi**4 * (a0**3 + 3 * np.pi**2 / 5 * b0) * chi**4
    )
    return 4 / 3 * E_STAR * np.sqrt(R) * depths_m**1.5 * factor


def test_bonded_layer_to_three_millimetres():
    depths = np.linspace(0.001, 0.003, 3)
    steps = quarter_block(0.0475, 0.0014, depths)[1]
    assert np.abs(forces_n(steps) / bonded_layer(depths, 0.0475) - 1).max() < 0.05


def test_hertz_at_small_depth_and_the_balance_of_forces_and_energy():
    depths = np.linspace(0.0001, 0.0005, 5)
    _, steps = quarter_block(0.12, 0.0005, depths, width_m=0.06)
    hertz = 4 / 3 * E_STAR * np.sqrt(R) * depths**1.5
    assert np.abs(forces_n(steps)[2:] / hertz[2:] - 1).max() < 0.03
    for step in steps:
        found = step.forces_n[0] + step.support_n
        # Symmetry planes carry the sideways parts.
        assert found[2] == pytest.approx(0, abs=1e-6 * abs(step.forces_n[0, 2]))
        assert step.penetration_m < 1e-5
    # The work of the sphere between two depths, by Simpson's rule, is what the solid stores.
    force = forces_n(steps, share=1)
    work = (depths[4] - depths[2]) / 6 * (force[2] + 4 * force[3] + force[4])
    assert steps[4].energy_j - steps[2].energy_j == pytest.approx(work, rel=0.02)


@pytest.mark.long
def test_friction_holds_points_and_hardly_changes_the_force():
    depths = np.linspace(0.0001, 0.0006, 6)
    mesh, without = quarter_block(0.03, 0.0007, depths, width_m=0.03)
    _, with_friction = quarter_block(0.03, 0.0007, depths, width_m=0.03, friction=0.5)
    assert forces_n(with_friction) == pytest.approx(forces_n(without), rel=0.03)
    nodes = mesh.nodes_m
    inner = (nodes[:, 2] > 0.03 - 1e-9) & (np.hypot(nodes[:, 0], nodes[:, 1]) < 0.001)
    # Under the sphere, points slide towards the middle unless friction resists.
    slid, stuck = (
        np.abs(steps[-1].displacement_m[inner, :2]).max() for steps in (without, with_friction)
    )
    assert stuck < 0.6 * slid


@pytest.mark.long
def test_a_foam_law_agrees_at_small_depth_and_is_stiffer_deep():
    depths = np.array([0.0001, 0.001, 0.004])
    neo = forces_n(quarter_block(0.0475, 0.0015, depths, width_m=0.06)[1])
    foam = forces_n(quarter_block(0.0475, 0.0015, depths, width_m=0.06, law=blatz_ko)[1])
    assert np.all(np.diff(foam / neo) > 0)
    assert foam[0] == pytest.approx(neo[0], rel=0.05)
    assert foam[2] > 1.1 * neo[2]


@pytest.mark.long
def test_a_ball_on_the_table_is_two_contacts_in_series(root):
    """Each side yields as Hertz says, at the probe and at the table."""
    spec = yaml.safe_load((root / "config/lab.yaml").read_text())["objects"]["foam_ball"]
    spec["contact"] |= {"table_friction": 0.0}
    radius = spec["shape"]["radius_m"]
    top = np.array([0, 0, 2 * radius])
    problem = contact_problem(spec, Ball(radius).model(top, spec["contact"]), top, R)
    modulus = spec["material"]["youngs_modulus_pa"] / (1 - spec["material"]["poisson_ratio"] ** 2)

    ends = 1 / (1 / R + 1 / radius), radius
    unit = sum((0.75 / (modulus * np.sqrt(end))) ** (2 / 3) for end in ends)
    for step in problem.indent(np.array([0.001, 0.002])):
        assert step.forces_n[:, 2].sum() == pytest.approx(0, abs=1e-6 * step.forces_n[1, 2])
        assert 4 * step.forces_n[1, 2] == pytest.approx((step.depth_m / unit) ** 1.5, rel=0.04)


@pytest.mark.long
def test_an_unbonded_ball_that_slips_in_part_comes_to_rest():
    top = np.array([0, 0, 0.132])
    contact = {"element_m": 0.002, "spacing_m": 0.016, "deepest_m": 0.003}
    contact |= {"friction": 0.0, "table_friction": 0.2}
    material = {"law": "blatz_ko", "youngs_modulus_pa": 72e3, "poisson_ratio": 0.22}
    spec = {"material": material, "contact": contact}
    problem = contact_problem(spec, Ball(0.066).model(top, contact), top, R)
    depths = np.linspace(0, 0.0023, 7)[1:]
    problem.indent(depths)
    # With the symmetric part of friction's tangent alone they are a fifth more.
    assert problem.iterations < 14 * len(depths)


def indented(size_m, material=MATERIAL, **contact):
    """Load steps of a block that is indented in its middle."""
    shape = {"kind": "block", "size_m": size_m}
    spec = {"shape": shape, "material": material, "contact": CONTACT | contact}
    return indent_object(spec, [0.0, 0.0, size_m[2]], R)


@pytest.mark.long
def test_a_quarter_gives_the_force_of_a_half():
    half, quarter = (indented([0.1, 0.08, 0.04], **more) for more in ({}, {"straight": True}))
    assert quarter.force_n == pytest.approx(half.force_n, rel=1e-3)
    moved = [steps.surface_displacement_m[-1] for steps in (half, quarter)]
    assert moved[1] == pytest.approx(moved[0], abs=2e-6)


@pytest.mark.long
def test_the_surface_far_from_the_contact_is_that_of_finer_elements(root):
    lab = yaml.safe_load((root / "config/lab.yaml").read_text())["objects"]["foam_block"]["contact"]
    lab |= {"step_m": 0.001, "deepest_m": 0.001, "element_m": 0.002, "straight": True}
    used, fine = (indented([0.12, 0.12, 0.0475], **one) for one in (lab, lab | {"growth": 1.25}))
    away = np.linalg.norm(used.surface_rest_m - used.point_m, axis=1)
    for low, high in ((0.008, 0.02), (0.02, 0.03), (0.03, 0.045)):
        ring = (away > low) & (away < high)
        moved, true = (steps.surface_displacement_m[-1][ring] for steps in (used, fine))
        assert (moved * true).sum() / (true * true).sum() == pytest.approx(1, abs=0.02)


def test_a_skin_fades_out_and_a_gradient_grows_to_the_base():
    places = np.zeros((5, 3))
    places[:, 2] = [0.0, 0.02, 0.0388, 0.0396, 0.04]
    skin = {"skin": {"thickness_m": 0.002, "stiffer": 3.0}}
    assert grade_of(skin, places, 0.04) == pytest.approx([1, 1, 3, 3, 3])
    assert grade_of({"gradient": 0.2}, places, 0.04)[:2] == pytest.approx([1.2, 1.1])


@pytest.mark.long
def test_a_graded_solid_lies_between_its_ends():
    """A skin through all of a block is a stiffer block; a stiffer base adds a part of itself."""
    through = {"skin": {"thickness_m": 1.0, "stiffer": 2.0}}
    thin = {"skin": {"thickness_m": 0.002, "stiffer": 2.0}}
    plain, whole, skin, base = (
        indented([0.1, 0.1, 0.04], MATERIAL | more).force_n[-1]
        for more in ({}, through, thin, {"gradient": 0.2})
    )
    assert whole == pytest.approx(2 * plain, rel=1e-3)
    assert plain < skin < whole
    assert 1.01 < base / plain < 1.1


@pytest.mark.parametrize("name", sorted(LAWS))
def test_stress_is_the_derivative_of_energy(name):
    law = LAWS[name](25e3, 0.3)
    rng = np.random.default_rng(0)
    F = np.eye(3) + 0.2 * rng.normal(size=(3, 3))
    d = rng.normal(size=(3, 3))
    h = 1e-6
    _, P, A = law(F)
    ahead, behind = law(F + h * d), law(F - h * d)
    assert (ahead[0] - behind[0]) / (2 * h) == pytest.approx((P * d).sum(), rel=1e-6)
    assert np.allclose((ahead[1] - behind[1]) / (2 * h), np.einsum("iJkL,kL->iJ", A, d), rtol=1e-5)


def test_relaxation_of_a_step_and_of_a_ramp():
    time_s = np.linspace(0, 5, 5001)
    series = {"fractions": [0.2, 0.1], "times_s": [0.3, 3.0]}
    step = relaxed_force(time_s, np.ones_like(time_s), **series)
    exact = 1 - 0.2 * (1 - np.exp(-time_s / 0.3)) - 0.1 * (1 - np.exp(-time_s / 3.0))
    assert np.allclose(step, exact, atol=1e-12)
    ramp = relaxed_force(time_s, time_s, **series)
    integral = 0.7 * time_s
    for g, tau in zip(series["fractions"], series["times_s"], strict=True):
        integral = integral + g * tau * (1 - np.exp(-time_s / tau))
    assert np.allclose(ramp, integral, atol=1e-9)

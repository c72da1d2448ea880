"""Deep spheres and layers: limits, printed numbers, and finite elements of a pressed layer."""

from dataclasses import replace

import numpy as np
import pytest
from palpate import hertz
from palpate.estimate.hertz.fit import hertz_force
from palpate.estimate.hertz.indentation import Indentation
from palpate.estimate.hertz.laws import (
    contact_law,
    layer_factor,
    layer_moments,
    parabola_force,
    printed_layer_factor,
    sneddon_force,
)
from palpate.estimate.hertz.models import fit_model, fit_models, recommended
from palpate.estimate.hertz.options import Hertz
from palpate.estimate.hertz.shape import Shape
from scipy.optimize import brentq, nnls
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, MeshQuad
from skfem.helpers import grad

R, TRUTH = 0.00622, 27473.0
OPTIONS = Hertz(assumed_poisson_ratio=0.3)
FINE, WIDE = 0.75, 8.0


def layer_compliance(nu, *, bonded):
    """Surface displacement by nodal forces of a layer of thickness 1 and E* = 1 on a rigid base.

    Axisymmetric second-order quadrilaterals; clamped or on rollers below.
    """
    far = FINE + (WIDE - FINE) * np.expm1(4 * np.linspace(0, 1, 14)) / np.expm1(4)
    radii = np.r_[np.linspace(0, FINE, 31), far[1:]]
    heights = np.sort(1 - np.expm1(3 * np.linspace(0, 1, 13)) / np.expm1(3))
    basis = Basis(MeshQuad.init_tensor(radii, heights), ElementVector(ElementQuad2()), intorder=5)
    E = 1 - nu**2
    lam, mu = E * nu / (1 + nu) / (1 - 2 * nu), E / 2 / (1 + nu)

    @BilinearForm
    def stiffness(u, v, w):
        r, g, h = w.x[0], grad(u), grad(v)
        volume = (g[0, 0] + g[1, 1] + u[0] / r) * (h[0, 0] + h[1, 1] + v[0] / r)
        shear = (g[0, 1] + g[1, 0]) * (h[0, 1] + h[1, 0]) / 2
        stretch = g[0, 0] * h[0, 0] + g[1, 1] * h[1, 1] + u[0] * v[0] / r**2
        return 2 * np.pi * r * (lam * volume + 2 * mu * (stretch + shear))

    low = basis.get_dofs(lambda x: x[1] < 1e-9)
    axis = basis.get_dofs(lambda x: x[0] < 1e-9).all(["u^1"])
    fixed = np.r_[low.all() if bonded else low.all(["u^2"]), axis]
    free = np.setdiff1d(np.arange(basis.N), fixed)
    top = basis.get_dofs(lambda x: x[1] > 1 - 1e-9).all(["u^2"])
    top = top[np.argsort(basis.doflocs[0, top])]
    top = top[basis.doflocs[0, top] <= FINE]
    place, loads = np.searchsorted(free, top), np.zeros((len(free), len(top)))
    loads[place, np.arange(len(top))] = 1
    solved = splu(stiffness.assemble(basis).tocsc()[free][:, free]).solve(loads)
    return solved[place], basis.doflocs[0, top]


def pressed(compliance, radius, chi):
    """Force of a paraboloid of R = 1 over Hertz's, by unilateral contact at the nodes."""
    lower = np.linalg.cholesky((compliance + compliance.T) / 2)
    gap = chi**2 - radius**2 / 2
    force, _ = nnls(lower.T, np.linalg.solve(lower, gap), maxiter=2000)
    return force.sum() / (4 / 3 * chi**3)


@pytest.mark.parametrize("support", ["bonded", "not_bonded"])
@pytest.mark.parametrize("nu", [0.3, 0.45, 0.495])
def test_layers_against_finite_elements(nu, support):
    compliance, radius = layer_compliance(nu, bonded=support == "bonded")
    for chi, within in ((0.2, 0.004), (0.3, 0.004), (0.4, 0.006), (0.6, 0.035)):
        found = pressed(compliance, radius, chi)
        assert layer_factor(chi, nu, support) == pytest.approx(found, rel=within)
    # The printed series, for which no such bound holds.
    printed = printed_layer_factor(0.4, nu, support) / pressed(compliance, radius, 0.4) - 1
    assert 0.005 < abs(printed) < 0.06


def test_printed_numbers_at_nu_one_half():
    chi = np.array([0.1, 0.2])
    bonded = 1 + 1.133 * chi + 1.283 * chi**2 + 0.769 * chi**3 - 0.0975 * chi**4
    smooth = 1 + 0.884 * chi + 0.781 * chi**2 + 0.386 * chi**3 + 0.0048 * chi**4
    assert printed_layer_factor(chi, 0.5, "bonded") == pytest.approx(bonded, rel=2e-4)
    assert printed_layer_factor(chi, 0.5, "not_bonded") == pytest.approx(smooth, rel=2e-4)
    # Garcia and Garcia print 1.133, 1.497, 1.469: the same kernel, expanded consistently.
    series = [1, 1.133, 1.497, 1.469]
    ours = layer_factor(chi, 0.5, "bonded")
    assert ours == pytest.approx(np.polynomial.polynomial.polyval(chi, series), rel=3e-3)


def test_moments_against_printed_ones():
    """The clamped base's agree within 0.6 %; a smooth base's do not depend on nu."""
    for nu in (0.3, 0.45, 0.5):
        a = -(1.2876 - 1.4678 * nu + 1.3442 * nu**2) / (1 - nu)
        assert layer_moments(nu, "bonded")[0] == pytest.approx(a, rel=6e-3)
    assert layer_moments(0.1, "not_bonded") == layer_moments(0.4, "not_bonded")
    assert layer_moments(0.3, "not_bonded")[0] == pytest.approx(-1.168, abs=1e-3)


def test_a_thick_layer_is_a_half_space():
    depth = np.linspace(0, 0.008, 9)
    for support in ("bonded", "not_bonded"):
        thick = contact_law("parabola", support, radius_m=R, thickness_m=1e3, nu=0.3)
        assert thick(depth) == pytest.approx(parabola_force(depth, R), rel=1e-4)


def test_sneddon():
    shallow = np.array([1e-6, 1e-5])
    assert sneddon_force(shallow, R) == pytest.approx(hertz_force(shallow, 1.0, R), rel=1e-3)
    for depth in (0.001, 0.004, 0.010):
        a = brentq(lambda a, d=depth: a / 2 * np.log((R + a) / (R - a)) - d, 1e-9, R * (1 - 1e-9))
        force = (a**2 + R**2) / 2 * np.log((R + a) / (R - a)) - a * R
        assert sneddon_force(depth, R) == pytest.approx(force, rel=1e-10)
    ratio = hertz_force(np.array([0.2, 0.3]) * R, 1.0, R) / sneddon_force(np.r_[0.2, 0.3] * R, R)
    assert ratio == pytest.approx([1.021, 1.031], abs=0.002)
    assert sneddon_force(np.array([-0.001, 0.0]), R).tolist() == [0, 0]


def press(deepest_m=0.008, thickness_m=0.0475, depth_std_m=1e-4, shift_m=0.0):
    depth = np.linspace(-0.003, deepest_m, 23)
    law = contact_law("sneddon", "bonded", radius_m=R, thickness_m=thickness_m, nu=0.3)
    force = TRUTH * law(depth) + np.random.default_rng(5).normal(0, 0.002, depth.size)
    onset = int(np.argmax(depth > 0))
    return Indentation(depth + shift_m, force, force, onset, R, thickness_m, depth_std_m)


def test_the_study_s_model_and_the_recommended_one():
    ours = press()
    studys, chosen = fit_models(ours, OPTIONS)
    assert recommended(ours, [studys, chosen]).items() >= chosen.items()
    known = fit_model(ours, OPTIONS, indenter="parabola", support="half_space", contact="known")
    assert studys["reduced_modulus_pa"] == known.reduced_modulus_pa
    assert (chosen["indenter"], chosen["support"]) == ("sneddon", "bonded")
    assert chosen["reduced_modulus_pa"] == pytest.approx(TRUTH, rel=0.02)
    assert chosen["poisson_ratio"] == 0.3
    assert "poisson_ratio" not in studys
    bonded, halfspace = (
        fit_model(ours, OPTIONS, indenter="sneddon", support=one, contact="known")
        for one in ("bonded", "half_space")
    )
    assert halfspace.reduced_modulus_pa > 1.08 * bonded.reduced_modulus_pa


def test_recommendation_follows_geometry():
    shallow = press(deepest_m=0.0005)
    assert recommended(shallow, fit_models(shallow, OPTIONS))["indenter"] == "parabola"
    thin = press(thickness_m=0.010)
    models = fit_models(thin, OPTIONS)
    assert {m["support"] for m in models} == {"half_space"}
    assert recommended(thin, models)["support"] == "half_space"


def test_where_no_law_holds_the_interval_reaches_to_all_of_them():
    """A side that takes a fifth of the force leaves the object softer than it is by as much."""
    ours = press()
    sure = recommended(ours, fit_models(ours, OPTIONS))
    assert not sure["doubts"]
    for part, most in ((0.2, 0.8), (0.99, 0.1)):
        unsure = replace(ours, shape=Shape(doubts=("no law",), side_part=part))
        models = fit_models(unsure, OPTIONS)
        low, high = recommended(unsure, models)["reduced_modulus_interval_pa"]
        ends = [m["reduced_modulus_interval_pa"] for m in models if m["contact"] == "weighted"]
        assert low == min(end for end, _ in ends) < sure["reduced_modulus_interval_pa"][0] + 1
        assert high == pytest.approx(max(end for _, end in ends) / most)


def test_a_layers_modulus_goes_with_one_poissons_ratio():
    """At chi 0.5 E with another ratio afterwards would be a fifth off, and is refused."""
    height, depth = 0.01, np.linspace(0, 0.25e-4 / R, 60)
    law = contact_law("parabola", "bonded", radius_m=R, thickness_m=height, nu=0.49)
    given = {"radius_m": R, "thickness_m": height, "indenter": "parabola"}
    given |= {"depth_m": depth, "force_n": TRUTH * law(depth), "baseline": False}
    right, other = (hertz.fit(**given, poisson_ratio=nu) for nu in (0.49, 0.33))
    E = TRUTH * (1 - 0.49**2)
    assert right.youngs_modulus_pa(0.49) == pytest.approx(E, rel=1e-3)
    assert other.reduced_modulus_pa * (1 - 0.49**2) > 1.2 * E
    line = "poisson_ratio: expected 0.33, which the layer was fitted with, found 0.49"
    for of in (other.youngs_modulus_pa, other.youngs_modulus_interval_pa):
        with pytest.raises(ValueError, match=line):
            of(0.49)


@pytest.mark.parametrize(("depth_std_m", "alike"), [(1e-7, "known"), (1.0, "free")])
def test_weighted_contact_lies_between_known_and_free(depth_std_m, alike):
    """At a deviation of 0 or without bound it is one of them; 0.5 mm too shallow a depth."""
    name = {"indenter": "sneddon", "support": "bonded"}
    end = press(depth_std_m=depth_std_m, shift_m=-5e-4)
    found = fit_model(end, OPTIONS, **name, contact="weighted").reduced_modulus_pa
    same = fit_model(end, OPTIONS, **name, contact=alike).reduced_modulus_pa
    assert found == pytest.approx(same, rel=5e-3)
    middle = press(depth_std_m=1e-5, shift_m=-5e-4)
    known, between, free = (
        fit_model(middle, OPTIONS, **name, contact=contact).reduced_modulus_pa
        for contact in ("known", "weighted", "free")
    )
    assert known > between > free


def test_models_that_are_refused():
    base = {"radius_m": R, "thickness_m": 0.05, "nu": 0.3}
    with pytest.raises(ValueError, match="indenter: expected one of parabola, sneddon, found cone"):
        contact_law("cone", "bonded", **base)
    with pytest.raises(ValueError, match="series: expected consistent or printed, found taylor"):
        contact_law("parabola", "bonded", **base, series="taylor")
    with pytest.raises(ValueError, match="support: expected one of half_space, bonded, not_bonded"):
        layer_factor(0.1, 0.3, "glued")
    with pytest.raises(ValueError, match="nu: expected a Poisson's ratio from 0 to 0.5, found 0.7"):
        layer_factor(0.1, 0.7, "bonded")

"""Hertz fits of made-up captures: range, models, a wrong zero, forces across; unusable input."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml
from palpate.capture.tables import write_table
from palpate.estimate.direct.options import Rig
from palpate.estimate.hertz.indentation import Indentation, hertz_range, indentation_of
from palpate.estimate.hertz.laws import contact_law, finite_strain_factor
from palpate.estimate.hertz.models import estimate_hertz, fit_model, fit_models, recommended
from palpate.estimate.hertz.options import Hertz
from palpate.estimate.hertz.shape import Shape
from palpate.solid.support import Support
from palpate.surface.alignment import Alignment, save_alignment
from palpate.surface.template import Template
from settings import full
from trimesh.creation import box

R, TRUTH, NU, HEIGHT = 0.00622, 27473.0, 0.3, 0.0475
TIP_STD_M, NOISE_N, TO_DEEPEST, WHOLE = 5e-5, 0.005, 25, 36
MODEL = {"indenter": "sneddon", "support": "bonded", "contact": "free"}
OPTIONS = Hertz(assumed_poisson_ratio=NU)
TIME = np.arange(WHOLE) / 6
# The alignment has made its own residual small, whatever its error.
RMS_M = 1e-3
# The camera looks down on the object, turned.
POSE = np.array([[1.0, 0, 0, 0.1], [0, -1, 0, 0.2], [0, 0, -1, 0.7], [0, 0, 0, 1]])


def depths(late_s=0.0):
    """Twelve frames of approach, twelve down to 7.5 mm, twelve held there [m]."""
    return np.clip((TIME + late_s - 1.95) * 0.0037, -0.007, 0.0075)


def force_of(depth_m):
    small = contact_law("sneddon", "bonded", radius_m=R, thickness_m=HEIGHT, nu=NU)
    return TRUTH * small(depth_m) * finite_strain_factor(depth_m / R, NU)


def pressed(zero_m=0.0, across=0.0, noise_n=NOISE_N, frames=WHOLE, seed=1, late_s=0.0, first=0):
    """Press of the middle of a block, its depth's zero off; across it friction, of that part.

    Forces are read so much later than they say.
    """
    block, rng, depth = box((0.3, 0.2, HEIGHT)), np.random.default_rng(seed), depths()
    tip = HEIGHT / 2 + R - depth - zero_m + rng.normal(0, TIP_STD_M, len(TIME))
    force = force_of(depths(late_s))
    # To one side and the other, from frame to frame.
    forces = np.stack([across * force * (-1) ** np.arange(len(TIME)), 0 * force, -force], axis=1)
    forces = forces + rng.normal(0, noise_n, forces.shape)
    tips = np.stack([0 * tip, 0 * tip, tip], axis=1)
    return indentation_of(
        Template(np.asarray(block.vertices), np.asarray(block.faces)),
        Support(np.array([0, 0, -HEIGHT / 2]), np.array([0.0, 0, 1]), 0.001),
        Alignment(POSE, np.array([0, 0, HEIGHT / 2]), 12, RMS_M),
        (tips @ POSE[:3, :3].T + POSE[:3, 3])[first:frames],
        (forces @ POSE[:3, :3].T)[first:frames],
        TIME[first:frames],
        radius_m=R,
        tip_std_m=TIP_STD_M,
        options=Hertz(),
    )


def best(press, **known):
    return estimate_hertz(press[0], Hertz(), **known)["recommended"]


def test_the_interval_holds_what_the_clocks_and_the_rig_may_be_off_by():
    alone, std = best(pressed()), {}
    for name, known in {"clock": {"clock_std_s": 0.05}, "rig": {"rig": Rig()}}.items():
        found = best(pressed(), **known)
        std[name] = found["rig_std"]
        for one in ("reduced_modulus", "later_reduced_modulus"):
            E = found[f"{one}_pa"]
            assert E == alone[f"{one}_pa"]
            ends = [np.log(np.array(of[f"{one}_interval_pa"]) / E) for of in (alone, found)]
            assert np.hypot(ends[0], 1.96 * std[name]) == pytest.approx(abs(ends[1]), rel=1e-3)
    # What forces do that were read 50 ms too late or too early.
    E = [best(pressed(late_s=late_s))["reduced_modulus_pa"] for late_s in (-0.05, 0.0, 0.05)]
    moved = np.sqrt(np.mean(np.log(np.array(E)[[0, 2]] / E[1]) ** 2))
    assert moved > 0.02
    assert std["clock"] == pytest.approx(moved, rel=0.3)
    # 1 % of the force's scale, 0.6 % of the curvature, 0.3 % of zero and drift.
    assert std["rig"] == pytest.approx(0.0125, rel=0.1)


@pytest.mark.parametrize("zero_m", [-1e-3, 1e-3])
@pytest.mark.parametrize("frames", [TO_DEEPEST, WHOLE])
def test_an_interval_holds_the_modulus_though_the_depths_zero_is_off(zero_m, frames):
    """By 1 mm, a deviation of it, in 0.06 N of noise, which leaves the contact's prior a say."""
    found = best(pressed(zero_m, noise_n=0.06, frames=frames, seed=2))
    low, high = found["reduced_modulus_interval_pa"]
    assert low < TRUTH < high < 2.5 * low


def test_without_samples_at_rest_there_is_a_warning():
    assert best(pressed(first=11))["warnings"] == [
        "too few samples to allow for relaxation and finite strain"
    ]


def test_friction_across_the_press_is_no_stiffness():
    straight, across = (pressed(across=part) for part in (0.0, 0.4))
    E = [best(one)["reduced_modulus_pa"] for one in (straight, across)]
    E += [fit_model(one, OPTIONS, **MODEL).reduced_modulus_pa for one, _ in (straight, across)]
    assert E[1::2] == pytest.approx(E[::2], rel=0.005)


def test_range_is_from_onset_to_where_the_force_falls_or_is_held():
    """Noise alone makes the highest sample of a hold that hardly relaxes."""
    force = np.array([0.01, 0.03, 0.02, 0.2, 0.6, 1.2, 1.1, 1.0])
    assert hertz_range(force, onset_force_n=0.1) == (3, 5)
    rng = np.random.default_rng(4)
    true = np.r_[np.zeros(10), np.linspace(0.2, 2.0, 8), np.full(20, 2.0)]
    force = true + rng.normal(0, 0.02, true.size)
    force[30] = force.max() + 0.01
    chosen = hertz_range(force, onset_force_n=0.1)
    assert chosen[0] == 10
    assert 17 <= chosen[1] <= 19


def ramp(deepest_m=0.008, thickness_m=HEIGHT, depth_std_m=1e-4, shift_m=0.0):
    depth = np.linspace(-0.003, deepest_m, 23)
    law = contact_law("sneddon", "bonded", radius_m=R, thickness_m=thickness_m, nu=0.3)
    force = TRUTH * law(depth) + np.random.default_rng(5).normal(0, 0.002, depth.size)
    onset = int(np.argmax(depth > 0))
    samples = np.arange(23) / 6, depth + shift_m, force, force, onset, 22
    return Indentation(*samples, R, thickness_m, 1e-5, depth_std_m, 0.002)


def test_the_study_s_model_and_the_recommended_one():
    ours = ramp()
    studys, chosen = fit_models(ours, OPTIONS)
    assert recommended(ours, [studys, chosen]).items() >= chosen.items()
    known = fit_model(ours, OPTIONS, indenter="parabola", support="half_space", contact="known")
    assert studys["reduced_modulus_pa"] == known.reduced_modulus_pa
    assert (chosen["indenter"], chosen["support"]) == ("sneddon", "bonded")
    assert chosen["reduced_modulus_pa"] == pytest.approx(TRUTH, rel=0.02)
    assert chosen["poisson_ratio"] == 0.3
    assert "poisson_ratio" not in studys


def test_recommendation_follows_geometry():
    shallow = ramp(deepest_m=0.0005)
    assert recommended(shallow, list(fit_models(shallow, OPTIONS)))["indenter"] == "parabola"
    models = fit_models(ramp(thickness_m=0.010), OPTIONS)
    assert {m["support"] for m in models} == {"half_space"}


def test_where_no_law_holds_the_interval_reaches_to_all_of_them():
    """A side that takes a fifth of the force leaves the object softer than it is by as much."""
    ours = ramp()
    sure = recommended(ours, list(fit_models(ours, OPTIONS)))
    assert not sure["warnings"]
    for part, most in ((0.2, 0.8), (0.99, 0.1)):
        unsure = replace(ours, shape=Shape(warnings=("no law",), side_part=part))
        models = list(fit_models(unsure, OPTIONS))
        low, high = recommended(unsure, models)["reduced_modulus_interval_pa"]
        ends = [m["reduced_modulus_interval_pa"] for m in models if m["contact"] == "weighted"]
        assert low == min(end for end, _ in ends) < sure["reduced_modulus_interval_pa"][0] + 1
        assert high == pytest.approx(max(end for _, end in ends) / most)


SIZE, TOP = 0.1, np.array([0.05, 0.05, 0.1])
FAR = "depth: expected the tip within 5 mm of the surface when the force begins, found it"
SUPPORT = {"plane_point_m": [0, 0, 0], "plane_normal": [0, 0, 1], "tolerance_m": 1e-3}
# Depth [mm] and force [N] of each sample, whether there is a baseline, and what is said.
UNUSABLE = [
    ([-1, 1], [0, 1], False, "force.csv: depth: expected at least 2 samples in contact, found 1"),
    ([-1, 1, 2], [0, 1, 2], True, "force.csv: samples: expected more than 3, found 3"),
    (
        *([-20, -17.5, -15, -12.5, -10], [0, 0.5, 1, 1.5, 2], False),
        f"probe_pose.csv: {FAR} 17.5 mm above in frame 1",
    ),
    ([-20, 7, 8], [0, 1, 2], False, f"probe_pose.csv: {FAR} 7.0 mm below in frame 1"),
    ([-1, 1], [0, 0.05], False, "force.csv: force: expected above 0.1 N, found at most 0.05"),
    ([-1, 1], [0.5, 0.9], False, "force.csv: force: expected samples before contact"),
]


@pytest.mark.parametrize(("depths_mm", "newtons", "baseline", "found"), UNUSABLE)
def test_what_a_hertz_stage_cannot_use_is_one_line(
    stage, root, tmp_path, depths_mm, newtons, baseline, found
):
    """Of an indentation into the top of a box."""
    cube = box((SIZE, SIZE, SIZE)).subdivide()
    cube.apply_translation([SIZE / 2] * 3).export(tmp_path / "template.ply")
    save_alignment(tmp_path / "alignment.json", Alignment(np.eye(4), TOP, 1, 1e-4))
    tips = TOP + [0, 0, R] - np.outer(depths_mm, [0, 0, 1e-3])
    poses = dict(zip(("tip_x_m", "tip_y_m", "tip_z_m"), tips.T, strict=True))
    table = pd.DataFrame(poses | {"raw_tip_std_along_m": 0 * tips[:, 0]})
    write_table(tmp_path / "probe_pose.csv", table)
    forces = {"time_s": np.arange(len(newtons)) / 6, "fx_n": 0.0, "fy_n": 0.0}
    write_table(tmp_path / "force.csv", pd.DataFrame(forces | {"fz_n": -np.array(newtons)}))
    (tmp_path / "clock.json").write_text('{"std_s": 0.02}')
    content = {"template": {"unit": "m", "vertices": 50}, "support": SUPPORT}
    content |= {"points": {"01": {"position_m": TOP.tolist()}}}
    (tmp_path / "object.yaml").write_text(yaml.safe_dump(content))
    files = "object.yaml template.ply alignment.json probe_pose.csv force.csv clock.json".split()
    names = "object template alignment pose force clock".split()
    inputs = {name: tmp_path / file for name, file in zip(names, files, strict=True)}
    config, probe = full(root), {"indenter": {"radius_m": R}}
    params = {"options": config["hertz"] | {"baseline": baseline}, "probe": probe}
    params["rig"] = config["direct"]["fit"]["rig"]
    line = stage("hertz", inputs=inputs, outputs={"fit": "made_fit"}, params=params)
    assert f"{tmp_path}/{found}" in line

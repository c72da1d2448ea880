"""Made-up results of an object: estimates, one capture's indentation, its tracked surface."""

from dataclasses import asdict

import numpy as np
import pandas as pd
import trimesh
from palpate.estimate.direct.motion import SurfaceMotion
from palpate.estimate.direct.result import CaptureFit
from palpate.modulus import LABELS, Modulus
from palpate.report.held import Held
from palpate.surface.pose import to_camera
from palpate.surface.tracked import Tracked

CAPTURE = {"object": "foam_block", "sensor": "kinect", "capture": "08", "point": "08"}
CAPTURE |= {"provenance": "simulated"}
GROUP = {name: CAPTURE[name] for name in ("object", "sensor", "provenance")}
# Down for 2 s at 2 mm/s, held for 1 s, and up; the camera takes five frames a second.
TIME_S = np.arange(0, 5.01, 0.2)
DEPTH_M = np.interp(TIME_S, [0, 1, 3, 4, 5], [-2e-3, 0, 4e-3, 4e-3, 0])
FORCE_N, FRAMES, UP = 500 * np.maximum(DEPTH_M, 0), np.arange(6, 21), np.array([0.0, 0, 1])
POSES = pd.DataFrame({"time_s": 10 + TIME_S, "detected": 1, "raw_tip_std_along_m": 5e-5})
POSES = POSES.assign(tip_x_m=0.0, tip_y_m=0.3, tip_z_m=0.4)
MODEL = {"reduced_modulus_pa": 21e3, "reduced_modulus_interval_pa": [20e3, 22e3]}
# The target has an offset.
HERTZ = {
    "samples": {"force_n": FORCE_N, "depth_m": DEPTH_M - 1e-3},
    "range": {"first_frame": 6, "last_frame": 15},
    "radius_m": 5e-3,
    **{"study": MODEL, "free_contact": MODEL, "recommended": MODEL | {"warnings": []}},
}


def source(name, *parts, std, unit):
    """Row of a budget, with its parts of log E*, log E and nu."""
    quantities = "log_effective_reduced_modulus", "log_youngs_modulus", "poisson_ratio"
    row = {"source": name, "standard_uncertainty": std, "unit": unit, "origin": "observed"}
    return row | {f"contribution_{q}": part for q, part in zip(quantities, parts, strict=True)}


def interval(value, half, verdict="identified", unit="Pa"):
    return asdict(Modulus(value, value - half, value + half, verdict, unit))


def estimate(E, nu, half, **changes):
    """direct.json, with intervals of E so wide to either side [Pa]."""
    star = E / (1 - nu**2)
    moduli = {"youngs_modulus_pa": E, "youngs_modulus_1s_pa": 0.94 * E, "reduced_modulus_pa": star}
    moduli |= {"effective_reduced_modulus_pa": 0.95 * star}
    moduli |= {"shear_modulus_pa": E / 2 / (1 + nu), "bulk_modulus_pa": E / 3 / (1 - 2 * nu)}
    found = {name: interval(value, half) for name, value in moduli.items()}
    found["bulk_modulus_pa"]["high"] = None
    residual = {"cells": 80, "motion_scale": 1.2, "motion_sharing": 4.0, "depth_scale": 1.1}
    noise = source("noise of the depth", 0.04, 0.03, 0.02, std=2e-4, unit="m")
    return {
        **found,
        "poisson_ratio": interval(nu, 0.05, unit="1"),
        "effective": {"depth_m": 0.0032, "strain": 0.18},
        "law": {name: {"value": 0.12, "std": 0.3} for name in ("force", "motion")},
        "relaxation": {"times_s": [0.2, 1.0], "fractions": [0.02, 0.0]},
        "information": {name: {"bound": 0.02, "efficiency": 0.5} for name in LABELS},
        "residuals": [residual],
        "nuisances": [{"offset_m": 0.001, "offset_std_m": 0.003}],
        "budget": [
            source("clocks of camera and force", 0.03, 0.04, 0.01, std=0.01, unit="s"),
            noise,
        ],
        **{"captures": ["08"], "frames": [12], "frames_beyond_lookup": [0]},
        **{"converged": True, "warnings": []},
    } | changes


JOINT = estimate(38120.0, 0.384, 3e3, poisson_ratio=interval(0.384, 0.1, "bounded", "1"))


def held(direct, poses=POSES, **capture):
    return Held(CAPTURE | capture, HERTZ, direct, poses, DEPTH_M, FRAMES)


# Motion of nine samples, of which the fit compares three.
RNG, CHOSEN, CONTACT_M = np.random.default_rng(2), np.array([7, 1, 4]), np.array([1e-3, 2e-3, 3e-3])
MOVED_M, CELL_M = RNG.normal(0, 1e-4, (len(TIME_S), 9)), RNG.uniform(-0.02, 0.02, (9, 3))
MOVED_M[0, 3] = MOVED_M[15, 1] = np.nan
STD_M = np.where(np.isfinite(MOVED_M), 1e-4, np.nan)
MOTION = SurfaceMotion(CELL_M, np.tile(UP, (9, 1)), MOVED_M, STD_M, np.full(9, 5e-5))
DEPTHS_M = DEPTH_M[FRAMES], 1.25 * DEPTH_M[FRAMES], np.full(len(FRAMES), 1e-4)
SEEN_M = MOVED_M[np.ix_(FRAMES, CHOSEN)]
MOTIONS_M = SEEN_M, SEEN_M - [0, 1e-5, 5e-5], np.full(SEEN_M.shape, 1e-5)
PLACES_M = CELL_M[CHOSEN], CONTACT_M, np.linalg.norm(CELL_M[CHOSEN] - CONTACT_M, axis=1)
FIT = CaptureFit(TIME_S, DEPTH_M, FRAMES, FORCE_N[FRAMES], *DEPTHS_M, *MOTIONS_M, *PLACES_M)
# A ball whose top goes with the tip, seen by a camera along its y axis.
BALL = trimesh.creation.icosphere(subdivisions=3, radius=0.04)
TOP, POSE = BALL.vertices[:, 2] > 0.03, np.eye(4)
POSE[:3] = [[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0.5]]
MOVED = BALL.vertices - np.multiply.outer(DEPTH_M, TOP)[..., None] * UP
PLACES = to_camera(POSE, BALL.vertices), to_camera(POSE, MOVED), np.full(MOVED.shape[:2], True)
SURFACE = Tracked(BALL.vertices, BALL.faces, *PLACES, POSE, np.zeros(len(MOVED)), 0.04 * UP, 5)

"""A capture of a made-up solid, and the first order by hand of each term of its budget."""

from dataclasses import fields, replace

import numpy as np
from made_up_indentation import (
    OPTIONS,
    RADIUS_M,
    UNBONDED,
    indentation_of,
    made_up_table,
    parameters,
    support_axes,
)
from palpate.estimate.direct import quantities
from palpate.estimate.direct.indentation import DirectIndentation
from palpate.estimate.direct.options import Fit, ModelStd, Rig

# A ratio of the made-up solid's table: between them its derivatives are interpolated.
E, NU = 25e3, 0.35
# Noise of depths and motions beside which each term stands, and as good as none.
NOISE_M, TINY = 5e-5, 1e-10
NOISES, APART = ("noise of the depth", "noise of the displacement"), "captures that differ"
TAU_S, SHARE_STD = OPTIONS.relaxation_times_s, 0.1
OF_FIT = {name for name in Fit.model_fields if "_std" in name} - {"model_std"}
NOTHING = OPTIONS.changed(
    **dict.fromkeys(OF_FIT - {"poisson_ratio_std"}, TINY)
    | {"fraction_step_std": 10.0, "sinking_std_m": 0.0, "rocking_std_rad": 0.0}
)
# Samples on one side of the contact, as a camera sees them.
SIDE_M = np.array([[x, y, 0.0] for x in np.linspace(0.016, 0.08, 9) for y in np.linspace(-x, x, 7)])


def as_options_say(capture, options):
    """A capture whose priors are those of the options."""
    return replace(
        capture,
        offset_std_m=options.offset_std_m,
        place_std_m=options.place_std_m,
        support_axes=support_axes(capture.cell_m, UNBONDED, options),
    )


CAPTURE = indentation_of(
    *(E, NU, 1),
    noise=0.0,
    amplitudes=(0.0, 0.0),
    motion_std_m=NOISE_M,
    solid=(SIDE_M, made_up_table(SIDE_M), made_up_table(SIDE_M)),
)
NO_SLIDING = np.zeros_like(CAPTURE.table.force_per_modulus_m2)
CAPTURE = replace(
    as_options_say(CAPTURE, NOTHING),
    tip_std_m=NOISE_M,
    force_std_n=TINY,
    clock_std_s=TINY,
    table=replace(made_up_table(SIDE_M), softer=NO_SLIDING),
)
TRUTH = parameters(E, NU)
FORCE_N, TIME_S = CAPTURE.force_n[CAPTURE.frames], CAPTURE.time_s[CAPTURE.frames]
SPEED_M_S = CAPTURE.speed_m_s
LOAD = FORCE_N / FORCE_N.max()
JUDGED = [quantities.NAMES.index(f"{name}_pa") for name in ("reduced_modulus", "youngs_modulus")]
JUDGED += [
    quantities.NAMES.index(name) for name in ("poisson_ratio", quantities.SHEAR, quantities.BULK)
]
# Of those by log E and nu, and E, G and K by nu at the same E*.
E_BY_NU = 2 * NU / (1 - NU**2)
G_BY_NU, K_BY_NU = 1 / (1 + NU), 2 / (1 - 2 * NU)
SLOPES = np.array([[1.0, E_BY_NU], [1.0, 0.0], [0.0, 1.0], [1.0, -G_BY_NU], [1.0, K_BY_NU]])
WITH_NU = E_BY_NU + G_BY_NU, K_BY_NU - E_BY_NU


def hertz(force_n=FORCE_N, stiffer=0.0, nu=NU):
    modulus = E * np.exp(stiffer) / (1 - nu**2)
    return (3 * force_n / (4 * modulus * np.sqrt(RADIUS_M))) ** (2 / 3)


DEPTH_M = hertz()


def surface(depth_m=DEPTH_M, nu=NU, place_m=(0.0, 0.0)):
    r = np.linalg.norm(CAPTURE.cell_m[:, :2] - place_m, axis=1)
    return -RADIUS_M * np.outer(depth_m, 1 / r - (5 + 20 * nu**2))


def stacked(depth_m, motion_m):
    """Depths and motions, one after the other."""
    shape = CAPTURE.moved_m.shape
    parts = np.broadcast_to(depth_m, shape[0]), np.broadcast_to(motion_m, shape).ravel()
    return np.concatenate(parts)


def slope(seen, step):
    return (seen(step) - seen(-step)) / (2 * step)


def by_moduli(stiffer=0.0, nu=0.0):
    depth = hertz(stiffer=stiffer, nu=NU + nu)
    return stacked(depth, surface(depth, NU + nu))


MODULI = [slope(by_moduli, 1e-4), slope(lambda x: by_moduli(nu=x), 1e-4)]


def by_force(error_n):
    """What an error of the force makes of depths and motions."""

    def seen(part):
        depth = hertz(FORCE_N + part * error_n)
        return stacked(depth, surface(depth))

    return slope(seen, 1e-4)


def by_place(way):
    return slope(lambda x: stacked(0.0, surface(place_m=x * way)), 1e-5)


def by_share(tau_s):
    """A share that relaxes: the elastic force is larger by what it has taken."""
    fine = np.linspace(0, CAPTURE.time_s[-1], 2001)
    rise = np.diff(np.interp(fine, CAPTURE.time_s, CAPTURE.force_n))
    since = np.maximum(TIME_S[:, None] - (fine[1:] + fine[:-1]) / 2, 0)
    return by_force(-np.expm1(-since / tau_s) @ rise)


def softer():
    """The second law's force over the first's, as a part of it."""
    return (0.4 - 0.4 * NU) * np.sqrt(DEPTH_M / 0.009)


def stiffer_alone():
    """What a law that is stiffer at the contact does to the depth; a force moves the rest alike."""
    depth, _ = np.split(by_force(-softer() * FORCE_N), [len(DEPTH_M)])
    return stacked(depth, 0.0)


def second_law():
    part = (RADIUS_M / np.linalg.norm(CAPTURE.cell_m, axis=1)) ** 2
    return -0.2 * np.outer(softer() * DEPTH_M, part)


def divided(change, depth_covariance, motion_std_m):
    depth, motion = np.split(change, [len(DEPTH_M)])
    root = np.linalg.cholesky(depth_covariance)
    return np.concatenate([np.linalg.solve(root, depth), motion / motion_std_m])


ALONE = np.eye(len(DEPTH_M)) * NOISE_M**2


def covariance_by_hand(learnt=(), known=0.0, depth_covariance=ALONE, motion_std_m=NOISE_M):
    """Of log E, nu and what else is learnt, of which `known` is the inverse beforehand."""
    changes = [*MODULI, *learnt]
    design = np.stack([divided(one, depth_covariance, motion_std_m) for one in changes], axis=1)
    return np.linalg.inv(design.T @ design + known), design


def by_hand(error=0.0, added=0.0, **of):
    """Deviations of those judged, with an error that is learnt of no capture, and what is added."""
    covariance, design = covariance_by_hand(**of)
    variance = np.diag(SLOPES @ covariance[:2, :2] @ SLOPES.T) + np.square(added)
    if np.ndim(error):
        moved = SLOPES @ covariance @ design.T @ divided(error, ALONE, NOISE_M)
        variance = variance + moved**2
    return np.sqrt(variance)


def learnt(*changes):
    """An unknown of the fit, or several of one deviation, by what a unit of each changes."""

    def of(std):
        return {"learnt": changes, "known": np.diag([0, 0] + [std**-2] * len(changes))}

    return of


def shares(std):
    """Known each by itself, and from one to the next."""
    known = np.eye(4) / SHARE_STD**2
    known[:2] = 0
    known[2:, 2:] += np.array([[1, -1], [-1, 1]]) / std**2
    return {"learnt": [by_share(tau) for tau in TAU_S], "known": known}


def error_of(change):
    return lambda std: {"error": std * change}


def added(*moves):
    """By how much a unit moves E*, E, nu, G and K."""
    return lambda std: {"added": std * np.array(moves)}


def depths(variance):
    return lambda std: {"depth_covariance": ALONE + variance(std)}


def alike(std_m):
    """Errors of depths of the same place and time: within 2 mm and 2 s."""
    way, time = np.subtract.outer(DEPTH_M, DEPTH_M), np.subtract.outer(TIME_S, TIME_S)
    return std_m**2 * np.exp(-((way / 0.002) ** 2) / 2 - np.abs(time / 2))


PART, CURVED = TIME_S / CAPTURE.time_s[-1], FORCE_N * RADIUS_M / 2
PLACES = learnt(*map(by_place, np.eye(2)))
# The base lies under the contact.
ROCKING = learnt(*(stacked(0.0, np.outer(LOAD, across)) for across in CAPTURE.cell_m.T[:2]))
BOTH_LATE = learnt(stacked(SPEED_M_S, surface(SPEED_M_S)))
OF_FORCE = depths(lambda std: np.diag((2 / 3 * DEPTH_M / FORCE_N * std) ** 2))
OF_TIP = depths(lambda std: ALONE * ((std / NOISE_M) ** 2 - 1))
# By field: its line of the budget, a deviation, and what that does.
TERMS = {
    "force_scale_std": ("scale of the force", 0.02, error_of(by_force(FORCE_N))),
    "force_zero_std_n": ("offset of the force", 0.02, error_of(by_force(np.ones_like(FORCE_N)))),
    "force_drift_std_n": ("drift of the force", 0.05, error_of(by_force(PART))),
    "radius_std_m": ("radius of the tip", 3e-4, error_of(by_force(FORCE_N / (2 * RADIUS_M)))),
    "curvature_std_per_m": ("curvature of the template", 8.0, error_of(by_force(CURVED))),
    "compliance_std_m_n": ("compliance of the probe", 2e-4, error_of(stacked(FORCE_N, 0.0))),
    "log_youngs_modulus": ("indentation table: force", 0.03, added(1.0, 1.0, 0.0, 1.0, 1.0)),
    "nu": ("indentation table: displacement", 0.03, added(0.0, E_BY_NU, 1.0, *WITH_NU)),
    "fraction_std": ("relaxation amplitudes", 0.05, learnt(*map(by_share, TAU_S))),
    "fraction_step_std": ("relaxation times", 0.1, shares),
    "gain_std": ("scale of the camera", 0.005, learnt(stacked(0.0, surface()))),
    "force_law_std": ("law of the force", 0.3, learnt(stiffer_alone())),
    "motion_law_std": ("law of the displacement", 0.5, learnt(stacked(0.0, second_law()))),
    "sphere_friction": ("friction at the sphere", 0.03, added(1.0, 1.0, 0.0, 1.0, 1.0)),
    "nu_loose": ("indentation table: base friction", 0.08, added(0.0, E_BY_NU, 1.0, *WITH_NU)),
    "poisson_ratio_std": (
        "given Poisson's ratio",
        0.01,
        lambda std: {"known": np.diag([0, std**-2])},
    ),
    "offset_std_m": ("offset of the depth", 2e-4, learnt(stacked(1.0, 0.0))),
    # The surface is seen at the other moment too.
    "clock_std_s": ("clocks of camera and force", 0.1, BOTH_LATE),
    # Where the poses' clock is off, force and surface still belong together.
    "camera_clock_std_s": ("clocks of poses and camera", 0.1, learnt(stacked(SPEED_M_S, 0.0))),
    "shift_std_m": ("offset of the displacement", 1e-4, learnt(stacked(0.0, 1.0))),
    "place_std_m": ("place of the contact", 3e-3, PLACES),
    # Tip and surface go down together.
    "sinking_std_m": ("support: sinking", 2e-4, learnt(stacked(LOAD, -LOAD[:, None]))),
    "rocking_std_rad": ("support: rocking", 3e-3, ROCKING),
    "tip_std_m": ("noise of the depth", 2e-4, OF_TIP),
    "force_std_n": ("noise of the depth", 0.05, OF_FORCE),
    "depth_pattern_std_m": ("noise of the depth", 2e-4, depths(alike)),
    "moved_std_m": ("noise of the displacement", 2e-4, lambda std: {"motion_std_m": std}),
}
BESIDE = {
    "fraction_step_std": {"fraction_std": SHARE_STD},
    "poisson_ratio_std": {"poisson_ratio": NU},
}
# What is measured; options have another name for one, and of the noise comes what is divided by.
MEASURED = {one.name for one in fields(DirectIndentation) if "_std" in one.name}
MEASURED -= {"noise_std_m"}
FIELDS = OF_FIT | {*Rig.model_fields, *ModelStd.model_fields} | MEASURED

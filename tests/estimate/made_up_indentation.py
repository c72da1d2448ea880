"""Made-up indentations of a solid with a formula, whose moduli are known."""

from dataclasses import replace

import numpy as np
from floor import floor
from palpate.estimate.direct.budget import budget_of
from palpate.estimate.direct.indentation import (
    OWN,
    SHARED,
    DirectIndentation,
    Parameters,
    SupportAxes,
)
from palpate.estimate.direct.motion import SurfaceMotion
from palpate.estimate.direct.options import Fit, ModelStd, Rig
from palpate.estimate.direct.quantities import Profile, intervals, quantities_of
from palpate.estimate.direct.table import SampleTable, axes_across
from palpate.estimate.relaxation import relaxed_force

RADIUS_M = 0.006
# What six errors of deviation 1 move three unknowns by, each of which has deviation 1 too.
SIX_ERRORS = np.linalg.qr(np.random.default_rng(1).normal(size=(6, 3)))[0].T
# Prony series of the made-up solid.
RELAXATION_TIMES_S, AMPLITUDES = (0.3, 3.0), (0.08, 0.05)
NO_RIG = Rig(**dict.fromkeys(Rig.model_fields, 0.0))
EXACT_TABLE = ModelStd(log_youngs_modulus=0.0, nu=0.0, nu_loose=0.0, sphere_friction=0.0)
OPTIONS = Fit(
    relaxation_times_s=RELAXATION_TIMES_S,
    fraction_std=0.1,
    fraction_step_std=0.1,
    shift_std_m=2e-5,
    rig=NO_RIG,
    model_std=EXACT_TABLE,
)


def parameters(E=1e4, nu=0.2, force_law=0.0, motion_law=0.0):
    """Unknowns of a capture that neither relaxes nor errs."""
    unknowns = [np.log(E), nu, force_law, motion_law, *np.zeros(SHARED - 4 + 2 + OWN)]
    return Parameters(np.array(unknowns), np.array(RELAXATION_TIMES_S))


def judged(best):
    """Moduli, their budget and their intervals at a solution."""
    stated = quantities_of(best, radius_m=RADIUS_M)
    budget = budget_of(best, stated, radius_m=RADIUS_M)
    return stated, budget, intervals(best, stated, budget, Profile.of(best, stated, budget))


START = parameters()
UNBONDED = floor(1e-3, height_m=-0.05, contact="resting")
BONDED = replace(UNBONDED, contact="bonded")
MOVING_SUPPORT = Fit(sinking_std_m=1e-4, rocking_std_rad=1e-3)


def made_up_table(cell_m):
    """Force like Hertz's; a surface that sinks less far off, and rises with nu.

    The second law stiffens like Blatz and Ko's, and draws the surface down with it.
    """
    nus, depth = np.array([0.0, 0.2, 0.35, 0.45, 0.49]), np.linspace(0, 0.009, 13)
    force = 4 / 3 * np.sqrt(RADIUS_M) * depth**1.5 / (1 - nus[:, None] ** 2)

    def motion(place_m):
        r = np.linalg.norm(cell_m - place_m, axis=1)
        each = [-depth[:, None] * RADIUS_M / r * (1 - (0.5 + 2 * nu**2) * (r / 0.1)) for nu in nus]
        return np.array(each)

    r, step = np.linalg.norm(cell_m, axis=1), 1e-4
    across = axes_across(np.array([0.0, 0.0, -1.0]))
    by_place = [(motion(step * axis) - motion(-step * axis)) / (2 * step) for axis in across]
    stiffening = np.outer(0.4 - 0.4 * nus, np.sqrt(depth / 0.009))
    change = -0.2 * stiffening[..., None] * depth[:, None] * (RADIUS_M / r) ** 2
    return SampleTable(
        nus, depth, force, stiffening, motion(np.zeros(3)), change, np.array(by_place)
    )


def support_axes(cell_m, support, options=MOVING_SUPPORT):
    """Axes along which the object moves on its support, indented from above at the origin."""
    up = np.array([0.0, 0, 1])
    return SupportAxes.of(
        cell_m,
        np.tile(up, (len(cell_m), 1)),
        support=support,
        contact_m=np.zeros(3),
        direction=-up,
        options=options,
    )


def wave(depth_m, rng, *, length_m=0.002, terms=12):
    """A smooth random function of the depth, of deviation 1."""
    turns, phases = rng.normal(0, 1 / length_m, terms), rng.uniform(0, 2 * np.pi, terms)
    return np.sqrt(2 / terms) * np.cos(np.outer(depth_m, turns) + phases).sum(axis=1)


def random_cells(rng):
    """Some 370 samples of a flat outside of the contact."""
    cell = np.column_stack([rng.uniform(-0.08, 0.08, (400, 2)), np.zeros(400)])
    return cell[np.linalg.norm(cell, axis=1) > 0.015]


def indentation_of(
    E,
    nu,
    seed,
    *,
    noise=1.0,
    amplitudes=AMPLITUDES,
    frames=24,
    maximum_depth_m=0.007,
    start_s=1.0,
    least_m=5e-4,
    kept=None,
    support=BONDED,
    delay_s=0.0,
    laws=(0.0, 0.0),
    solid=None,
    motion_std_m=5e-5,
    offset_std_m=1e-4,
    beside_m=(0.0, 0.0),
    rate_hz=6,
    wavy_m=0.0,
    poses_per_frame=1,
    camera_clock_s=0.0,
):
    """A capture: rest, a ramp of 1.8 s, hold.

    `noise` scales all errors but the depth's smooth one, whose deviation is `wavy_m`. `solid` is
    samples, the table that moves them and the table that is fitted; `delay_s` is the force's
    clock's, `kept` the number of frames compared, `beside_m` the contact's place. Poses from
    elsewhere are between the frames too, and `camera_clock_s` is their clock minus the camera's.
    """
    rng = np.random.default_rng(seed)
    cell = random_cells(rng)
    cell, model, table = solid or (cell, made_up_table(cell), made_up_table(cell))
    rows = (frames - 1) * poses_per_frame + 1
    time = np.arange(rows) / rate_hz / poses_per_frame
    pictured = np.arange(0, rows, poses_per_frame)

    def forces(at_s):
        depth = maximum_depth_m * np.clip((at_s - start_s) / 1.8, 0, 1)
        elastic = E * model.force(depth, nu, laws[0])
        relaxed = relaxed_force(at_s, elastic, fractions=amplitudes, times_s=RELAXATION_TIMES_S)
        return depth, elastic, relaxed

    depth, elastic, force = forces(time)
    if delay_s:
        fine = np.arange(0, time[-1] + 0.1, 0.005)
        force = np.interp(time + delay_s, fine, forces(fine)[2])
    force = force + noise * rng.normal(0, 0.003 * force.max(), rows)
    used = np.flatnonzero(depth > least_m)[:kept]
    # What the force moves depends on the force, whatever the law at the contact.
    seen_at = forces(time + camera_clock_s)[1] if camera_clock_s else elastic
    first = model.depth(seen_at[used] / E, nu, 0.0).depth_m
    motion = model.motion(first, nu, laws[1], np.array(beside_m)).motion_m
    motion = motion + noise * rng.normal(0, motion_std_m, motion.shape)
    motion[~np.isin(used, pictured)] = np.nan
    offset = noise * rng.normal(0, offset_std_m)
    measured = depth[used] + offset + noise * rng.normal(0, 8e-5, len(used))
    measured += wavy_m * wave(depth[used], rng)
    cluster = np.unique((cell[:, :2] // 0.02).astype(int), axis=0, return_inverse=True)[1].ravel()
    return DirectIndentation(
        time_s=time,
        force_n=force,
        tip_depth_m=depth,
        frames=used,
        frames_beyond=0,
        oblique_rad=0.0,
        depth_m=measured,
        tip_std_m=8e-5,
        depth_root_m=8e-5 * np.eye(len(used)),
        offset_std_m=offset_std_m,
        clock_expected_s=0.0,
        clock_std_s=0.01,
        force_std_n=0.003 * force.max(),
        contact_m=np.zeros(3),
        cell_m=cell,
        moved_m=motion,
        noise_std_m=np.full(motion.shape, motion_std_m),
        moved_std_m=np.full(motion.shape, motion_std_m),
        place_expected_m=np.zeros(2),
        place_std_m=5e-4,
        cluster=cluster,
        support_axes=support_axes(cell, support),
        table=table,
        pictured=pictured,
    )


def displacement_of(cell_m, normal, moved_m, *, std_m=1e-4, rest_std_m=4e-5):
    """Displacement along the normals of samples that are seen in all frames."""
    return SurfaceMotion(
        cell_m=cell_m,
        normal=normal,
        moved_m=moved_m,
        std_m=np.full(moved_m.shape, std_m),
        rest_std_m=np.full(len(cell_m), rest_std_m),
    )

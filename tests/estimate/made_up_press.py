"""Presses of a made-up solid whose moduli are known, for the tests of the direct estimate."""

from dataclasses import replace

import numpy as np
from floor import floor
from palpate.estimate.direct.indentation import DirectIndentation, Parameters
from palpate.estimate.direct.options import Fit, ModelStd, Rig
from palpate.estimate.direct.support_motion import rocking_axes, support_axes_of
from palpate.estimate.direct.table import SampleTable
from palpate.estimate.relaxation import relaxed_force

RADIUS_M = 0.006
# Relaxation times of what is pressed, and what relaxes with them.
SHARE_TIMES_S, SHARES = (0.3, 3.0), (0.08, 0.05)
NO_RIG = Rig(**dict.fromkeys(Rig.model_fields, 0.0))
OPTIONS = Fit(
    relaxation_times_s=SHARE_TIMES_S,
    fraction_std=0.1,
    fraction_step_std=0.1,
    rig=NO_RIG,
    model_std=ModelStd(log_youngs_modulus=0.0, nu=0.0, nu_loose=0.0),
)
START = Parameters(1e4, 0.2, 0.0, 0.0, 0.0, np.zeros(2), 0.0, 0.0, *map(np.zeros, (3, 2, 2, 3)))
ACROSS = rocking_axes(np.array([0.0, 0.0, -1.0]))
STANDING = floor(1e-3, height_m=-0.05, contact="resting")


def model_of(cell_m):
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
    ends = [(motion(step * axis), motion(-step * axis)) for axis in ACROSS]
    by_place = np.array([(far - near) / (2 * step) for far, near in ends])
    # Of no sample the material is followed.
    by_place = np.concatenate([by_place, 0 * by_place])
    stiffening = np.outer(0.4 - 0.4 * nus, np.sqrt(depth / 0.009))
    change = -0.2 * stiffening[..., None] * depth[:, None] * (RADIUS_M / r) ** 2
    sticks = np.zeros_like(force), np.zeros_like(change)
    found = motion(np.zeros(3)), change
    return SampleTable(nus, depth, force, stiffening, *found, *sticks, by_place)


def sinks(cell_m):
    """What a foot that slides adds to the motion, over the depth: less and less of it."""
    return -0.05 * (1 - np.linalg.norm(cell_m, axis=1) / 0.06)


def sliding(cell_m):
    """The same of a solid whose foot may slide, and is softer where it does."""
    table = model_of(cell_m)
    yielding = np.broadcast_to(-0.1 * np.sqrt(table.depth_m / 0.009), table.stiffening.shape)
    by_foot = np.broadcast_to(np.outer(table.depth_m, sinks(cell_m)), table.motion_m.shape)
    return replace(table, yielding=yielding, motion_by_foot=by_foot)


SETTLING = Fit(sinking_std_m=1e-4, rocking_std_rad=1e-3)


def support_axes(cell_m, support, options=SETTLING):
    return support_axes_of(
        cell_m,
        np.tile([0.0, 0, 1], (len(cell_m), 1)),
        support=support,
        contact_m=np.zeros(3),
        direction=np.array([0.0, 0, -1]),
        options=options,
    )


def wave(way_m, rng, *, length_m=0.002, terms=12):
    """A smooth random function of a way, of deviation 1."""
    turns, phases = rng.normal(0, 1 / length_m, terms), rng.uniform(0, 2 * np.pi, terms)
    return np.sqrt(2 / terms) * np.cos(np.outer(way_m, turns) + phases).sum(axis=1)


def press_of(
    E,
    nu,
    seed,
    *,
    noise=1.0,
    shares=SHARES,
    frames=24,
    deepest_m=0.007,
    start_s=1.0,
    least_m=5e-4,
    kept=None,
    support=None,
    late_s=0.0,
    laws=(0.0, 0.0),
    solid=None,
    motion_std_m=5e-5,
    offset_std_m=1e-4,
    beside_m=(0.0, 0.0),
    rate_hz=6,
    wavy_m=0.0,
    foot=0.0,
):
    """A capture of 24 frames: rest, press, hold.

    A depth's error that hangs on the way is `wavy_m`. A solid of its own is its samples' places,
    what it does, and the table that is fitted to it.
    """
    rng = np.random.default_rng(seed)
    cell = np.column_stack([rng.uniform(-0.08, 0.08, (400, 2)), np.zeros(400)])
    cell = cell[np.linalg.norm(cell, axis=1) > 0.015]
    table = model = model_of(cell)
    if solid:
        cell, model, table = solid
    time = np.arange(frames) / rate_hz
    depth = deepest_m * np.clip((time - start_s) / 1.8, 0, 1)
    elastic = E * model.force(depth, nu, laws[0], foot)
    force = relaxed_force(time, elastic, fractions=shares, times_s=SHARE_TIMES_S)
    if late_s:
        fine = np.arange(0, time[-1] + 0.1, 0.005)
        way = deepest_m * np.clip((fine - start_s) / 1.8, 0, 1)
        whole = E * model.force(way, nu, laws[0], foot)
        whole = relaxed_force(fine, whole, fractions=shares, times_s=SHARE_TIMES_S)
        force = np.interp(time + late_s, fine, whole)
    force = force + noise * rng.normal(0, 0.003 * force.max(), frames)
    used = np.flatnonzero(depth > least_m)[:kept]
    # What the force moves hangs on the force, whatever the law at the contact.
    first = model.depth(elastic[used] / E, nu, 0.0, foot).depth_m
    places = np.append(beside_m, [0.0, 0.0])
    motion = model.motion(first, nu, laws[1], places, foot).motion_m
    motion = motion + noise * rng.normal(0, motion_std_m, motion.shape)
    offset = noise * rng.normal(0, offset_std_m)
    measured = depth[used] + offset + noise * rng.normal(0, 8e-5, len(used))
    measured += wavy_m * wave(depth[used], rng)
    cluster = np.unique((cell[:, :2] // 0.02).astype(int), axis=0, return_inverse=True)[1].ravel()
    return DirectIndentation(
        time_s=time,
        force_n=force,
        sideways_n=0.1 * force,
        tip_depth_m=depth,
        frames=used,
        frames_beyond=0,
        oblique_rad=0.0,
        depth_m=measured,
        speed_m_s=np.gradient(depth, time)[used],
        tip_std_m=8e-5,
        pattern_std_m=3e-5,
        depth_root_m=8e-5 * np.eye(len(used)),
        offset_std_m=offset_std_m,
        clock_expected_s=0.0,
        clock_std_s=0.01,
        force_std_n=0.003 * force.max(),
        contact_m=np.zeros(3),
        cell_m=cell,
        way=np.tile([0.0, 0, 1], (len(cell), 1)),
        axis=np.zeros(len(cell), dtype=int),
        moved_m=motion,
        noise_std_m=np.full(motion.shape, motion_std_m),
        moved_std_m=np.full(motion.shape, motion_std_m),
        shift_std_m=2e-5,
        place_expected_m=np.zeros(2),
        place_std_m=5e-4,
        picture_std_m=1e-3,
        patch_m=0.02,
        cluster=cluster,
        support_axes=support_axes(cell, support or replace(STANDING, contact="bonded")),
        table=table,
    )

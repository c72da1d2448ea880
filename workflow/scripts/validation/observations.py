"""Randomised rigs without pictures: the lab's contact solutions with the noise of recordings.

    python -m validation.observations RUN [--draws 50] [--seed 0] [--ranges FILE.yaml]

of the folder of a finished `make validation`, or of the project after `make results`, whose
objects, contact solutions and indentation tables are taken. FILE.yaml, config/observations.yaml by
default, says what is drawn; tables of its name, FILE.csv and FILE_by_tenth.csv, are written into
RUN/results, and how often intervals hold is printed. Errors of template, radius and table are those
of the run, the same in all draws of an object, which are therefore not quite independent; crosstalk
of the force, outliers and missing samples are left out.
"""

import argparse
import zlib
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import cycle, islice
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.random import Generator
from numpy.typing import NDArray
from palpate.estimate.direct.contact import object_from_table
from palpate.estimate.direct.deviations import ALIKE_M
from palpate.estimate.direct.estimate import estimate_direct
from palpate.estimate.direct.indentation import DirectIndentation
from palpate.estimate.direct.options import Fit, ProbeUncertainty
from palpate.estimate.direct.quantities import NAMES
from palpate.estimate.direct.table import axes_across
from palpate.modulus import columns
from palpate.npz import read_npz
from palpate.open3d_core import o3d, scene_of
from palpate.plan import Noise, Planned, Protocol
from palpate.solid.indentation_table import IndentationModel
from palpate.solid.smooth_surface import SmoothSurface
from palpate.surface.pose import to_camera
from palpate.surface.template import Template
from palpate.yaml_files import load_yaml
from scipy.interpolate import PchipInterpolator
from scipy.signal import lfilter
from scipy.spatial import cKDTree
from scipy.stats import kstest
from scipy.stats import t as student
from validation.forecasts import rig_of
from validation.measured import truth_of
from validation.randomised_rigs import MODULI, summary_of

RANGES = Path("config/observations.yaml")
# A ray starts so far outside of the surface; contacts beside each other, for slopes [m].
OUTSIDE_M, ASIDE_M = 0.02, 0.001
# F^(2/3) is about linear in depth.
FORCE_POWER = 2 / 3
# Deviations of what each recording draws for itself; columns of drawn quantities begin so.
OF_CAPTURE, DRAWN = ("clock_offset_std_s", "force_drift_std_n"), "drawn_"


@dataclass(frozen=True)
class Contact:
    """The lab's solution of an indentation: force and surface over depth.

    Attributes
    ----------
    point_m : (3,) array
        Of the first touch, object frame [m].
    depth_m, force_n : (k,) arrays
        From 0 [m, N].
    rest_m, faces : arrays
        Undeformed surface (n, 3) [m] and its triangles.
    displacement_m : (k, n, 3) array
        Of the surface [m].
    """

    point_m: NDArray
    depth_m: NDArray
    force_n: NDArray
    rest_m: NDArray
    faces: NDArray
    displacement_m: NDArray

    @staticmethod
    def read(path: Path) -> "Contact":
        """Read contact-<point>.npz."""
        data = read_npz(path)
        moved_m = data["surface_displacement_m"].astype(float)
        surface = data["surface_rest_m"], data["surface_faces"], moved_m
        return Contact(data["point_m"], data["depth_m"], data["force_n"], *surface)

    def force_at(self, depth_m: NDArray) -> NDArray:
        """Elastic force at depths [N]; zero before contact."""
        curve = PchipInterpolator(self.depth_m, self.force_n**FORCE_POWER)
        return curve(np.clip(depth_m, 0, self.depth_m[-1])) ** (1 / FORCE_POWER)

    def motion(self, cell_m: NDArray, normal: NDArray) -> NDArray:
        """Way along normals from undeformed to deformed surface, (k, c) [m]; NaN: past both."""
        middle = cell_m.mean(axis=0)
        rays = np.hstack([cell_m + OUTSIDE_M * normal - middle, -normal])
        rays = o3d.core.Tensor(rays.astype(np.float32))
        scenes = (scene_of(self.rest_m + one - middle, self.faces) for one in self.displacement_m)
        hits = [scene.cast_rays(rays, nthreads=1)["t_hit"].numpy() for scene in scenes]
        ways = np.array(hits, dtype=float)
        ways[~np.isfinite(ways)] = np.nan
        return ways[0] - ways


@dataclass(frozen=True)
class Lab:
    """A point of an object of the lab, a sensor, and what is drawn of recordings of it.

    Attributes
    ----------
    planned : Planned
        Table, template and rig as the files state them.
    contact : Contact
    material : mapping
        material.json.
    ranges, noise : mapping
        Of such a file: protocols and rigs, and the noise of the sensor's recordings.
    """

    planned: Planned
    contact: Contact
    material: Mapping
    ranges: Mapping
    noise: Mapping

    @cached_property
    def _motion(self) -> tuple[cKDTree, PchipInterpolator]:
        """Samples, and over depth how far they move and what a contact farther on adds, (3, c)."""
        cells, normal = self.planned.samples.cell_m, self.planned.samples.normal
        aside = ASIDE_M * axes_across(self.planned.table.direction)
        here, *beside = (self.contact.motion(cells + way, normal) for way in (0, *-aside, *aside))
        slopes = (np.array(beside[:2]) - beside[2:]) / (2 * ASIDE_M)
        # Rays that miss are of samples that no camera sees.
        known = np.nan_to_num(np.stack([here, *slopes], axis=1))
        return cKDTree(cells), PchipInterpolator(self.contact.depth_m, known)

    def draw(self, rng: Generator, *others: "Lab") -> tuple[list[DirectIndentation], dict, dict]:
        """Captures of a rig, the material, and what was drawn.

        ``others`` are further points of the object: captures are at each point in turn. The drawn
        force is the first point's; others bear what the same material returns there.

        Raises
        ------
        ValueError
            If the captures determine nothing, as of a camera that sees no surface.
        """
        ranges, points = self.ranges, (self, *others)
        deepest_m = min(one.contact.depth_m[-1] for one in points)
        drawn = {name: rng.uniform(*ends) for name, ends in ranges["evenly"].items()}
        drawn |= {name: std * rng.normal() for name, std in ranges["rig_std"].items()}
        drawn["captures"] = int(rng.integers(*ranges["captures"], endpoint=True))
        drawn["depth_m"] = drawn.pop("part_of_deepest") * deepest_m
        drawn["distance_m"] = rng.uniform(*ranges["distance_m"][self.planned.sensor["sensor"]])
        unit_n = float(self.contact.force_at(np.array([drawn["depth_m"]]))[0])
        force_n = unit_n * np.exp(rng.uniform(*np.log(ranges["force_over_solution"])))
        drawn["force_n"] = float(np.clip(force_n, *ranges["force_n"]))
        times_s = ranges["relaxation_times_s"]
        fractions = rng.uniform(*ranges["relaxation_fraction"], len(times_s))
        drawn["relaxing"] = float(fractions.sum())
        times_s = [rng.uniform(*ends) for ends in times_s]
        relaxation = {"fractions": fractions.tolist(), "times_s": times_s}
        stiffer = drawn["force_n"] / unit_n
        tip_m = self.noise["rig_tip_m"] * rng.normal(size=3)
        given = drawn, relaxation, stiffer, tip_m
        indented = [one._capture(rng, *given) for one in islice(cycle(points), drawn["captures"])]
        E = stiffer * self.material["youngs_modulus_pa"]
        material = self.material | {"youngs_modulus_pa": E, "relaxation": relaxation}
        return indented, material, drawn

    def _at(self, distance_m: float) -> Planned:
        """The same with the noise that is stated at a distance [m]; samples stay."""
        noise = Noise.expected(self.planned.sensor, self.planned.probe, distance_m)
        moved = replace(self.planned, noise=replace(noise, force_n=self.noise["force_n"]))
        vars(moved)["_samples"] = self.planned._samples
        return moved

    def _capture(
        self, rng: Generator, drawn: Mapping, relaxation: Mapping, stiffer: float, tip_m: NDArray
    ) -> DirectIndentation:
        noise, planned = self.noise, self._at(drawn["distance_m"])
        depth_m = drawn["depth_m"] * (1 - self.ranges["depth_spread"] * rng.uniform())
        up, aside = np.deg2rad([drawn["elevation_deg"], drawn["azimuth_deg"]])
        away = [np.sin(aside) * np.cos(up), -np.cos(aside) * np.cos(up), np.sin(up)]
        camera_m = planned.table.point_m + drawn["distance_m"] * np.array(away)
        rate_hz = drawn["frame_rate_hz"]
        protocol = Protocol(depth_m, rate_hz, planned.table.radius_m, camera_m, captures=1)
        fine_s, path_m = _path(depth_m, drawn["press_s"], drawn["hold_s"])
        force_n = stiffer * relaxed(fine_s, self.contact.force_at(path_m), **relaxation)
        time_s = np.arange(0, fine_s[-1], 1 / rate_hz)
        time_s = time_s[rng.random(len(time_s)) >= self.ranges["dropped_frames"]]
        clock_s, drift_n = rng.normal(size=2) * [self.ranges[name] for name in OF_CAPTURE]
        # What the offset that was found is too large by; the force comes late.
        mean_s, std_s = noise["clock_error_s"]
        error_s = mean_s + std_s * rng.normal()
        late_s = error_s - self.ranges["force_lag_s"]
        read_n = (1 + drawn["force_gain"]) * np.interp(time_s + late_s, fine_s, force_n)
        read_n += drift_n * time_s / time_s[-1]
        read_n += noise["force_n"] * rng.normal(size=len(time_s))
        true_m = np.interp(time_s, fine_s, path_m)
        exact, rest = planned.exact(protocol, time_s, true_m, read_n)
        # Of tips: what a rig's captures share, what each has, and what depends on the place.
        off_m = tip_m + noise["capture_tip_m"] * rng.normal(size=3)
        apart = (true_m[:, None] - true_m) / ALIKE_M
        alike = np.linalg.cholesky(np.exp(-(apart**2) / 2) + 1e-9 * np.eye(len(true_m)))
        found_m = true_m + off_m[0] + noise["pattern_m"] * alike @ rng.normal(size=len(true_m))
        samples, motion = self._motion
        seen_m = np.interp(time_s[exact.frames] + noise["depth_delay_s"], fine_s, path_m)
        moved_m = motion(np.maximum(seen_m, 0))[..., samples.query(exact.cell_m)[1]]
        moved_m = moved_m[:, 0] + np.tensordot(moved_m[:, 1:], off_m[1:], axes=(1, 0))
        beside_m = self.contact.point_m - planned.table.point_m
        known = {"tip_depth_m": found_m, "depth_m": found_m[exact.frames]}
        known["place_expected_m"] = axes_across(planned.table.direction) @ beside_m
        exact = replace(exact, **known, clock_expected_s=clock_s + error_s)
        moved_m = np.where(exact.seen, (1 + drawn["scale"]) * moved_m, np.nan)
        return planned.noisy(exact, moved_m, rest, rng, **noise["over_stated"])


def _path(depth_m: float, press_s: float, hold_s: float) -> tuple[NDArray, NDArray]:
    """Times [s] and depths [m] of an indentation: at rest, towards it, into it, held."""
    ends_s = np.cumsum([0.0, 1.0, 0.6, press_s, hold_s + 0.3])
    time_s = np.arange(0, ends_s[-1], 0.002)
    depth_m = np.interp(time_s, ends_s, [-0.015, -0.015, 0.0, depth_m, depth_m])
    # A hand has no corners.
    window = np.hanning(101) / np.hanning(101).sum()
    smooth = np.convolve(np.pad(depth_m, 50, mode="edge"), window, mode="valid")
    return time_s, np.where(smooth <= -0.015 + 1e-12, -0.015, smooth)


def relaxed(
    time_s: NDArray, force_n: NDArray, *, fractions: Sequence[float], times_s: Sequence[float]
) -> NDArray:
    """Prony series over an elastic force at even times, (n,) [N]; none of the estimator's code."""
    relaxed, step_s = force_n * (1 - sum(fractions)), time_s[1] - time_s[0]
    for fraction, tau in zip(fractions, times_s, strict=True):
        kept = np.exp(-step_s / tau)
        gain = fraction * (1 - kept) * tau / step_s
        relaxed = relaxed + lfilter([gain], [1, -kept], np.diff(force_n, prepend=0.0))
    return relaxed


def lab_of(run: Path, name: str, sensor: str, ranges: Mapping, point: str = "01") -> Lab:
    """An object's point and a sensor of a run, by its files and what is drawn."""
    given = run if (run / "config.yaml").is_file() else run / "config"
    config, results = load_yaml(given / "config.yaml"), run / "results"
    rig = rig_of(run / "raw" / name, results / name, point, given / "sensors", sensor)
    material = load_yaml(results / "lab" / name / "material.json")
    contact = Contact.read(results / "lab" / name / f"contact-{point}.npz")
    rig = (_brought(*rig[:2], contact.point_m), *rig[1:4], rig[4] | ranges.get("probe", {}))
    noise = Noise.expected(*rig[3:], float(np.mean(ranges["distance_m"][sensor])))
    fit = Fit.read(ranges.get("fit", config.get("direct", {}).get("fit", {})))
    of_guess = material["youngs_modulus_pa"], material["poisson_ratio"]
    planned = Planned(*rig, noise, *of_guess, fit)
    return Lab(planned, contact, material, ranges, ranges["noise"][sensor])


def _brought(table: IndentationModel, template: Template, point_m: NDArray) -> IndentationModel:
    """Bring a table from the declared point to that of the first touch, as the estimate does."""
    surface = SmoothSurface(template.vertices_m, template.faces)
    place = object_from_table(table, surface, point_m - table.radius_m * table.direction)
    turn = place[:3, :3]
    return replace(
        table,
        point_m=to_camera(place, table.point_m[None])[0],
        direction=turn @ table.direction,
        surface_rest_m=to_camera(place, table.surface_rest_m),
        surface_displacement_m=table.surface_displacement_m @ turn.T.astype(np.float32),
    )


def solved_points(results: Path, name: str) -> list[str]:
    """Points of an object whose contact the lab has solved."""
    solved = sorted((results / "lab" / name).glob("contact-*.npz"))
    return [path.stem.partition("-")[2] for path in solved]


def estimates(
    run: Path, ranges: Mapping, name: str, sensor: str, draws: int, seed: int
) -> list[dict]:
    """Estimates of draws of an object and a sensor beside their truth, one row each."""
    points = solved_points(run / "results", name)[: ranges.get("points", 1)]
    try:
        (lab, *others), rows = [lab_of(run, name, sensor, ranges, one) for one in points], []
    except ValueError as error:
        return [{"object": name, "sensor": sensor, "rejected": str(error)}]
    planned, known = lab.planned, ProbeUncertainty.of(lab.planned.probe)
    radius_m = planned.table.radius_m
    for k in range(draws):
        rng = np.random.default_rng([seed, zlib.crc32(f"{name} {sensor}".encode()), k])
        row = {"object": name, "sensor": sensor, "law": lab.material["law"], "rig": f"{name} {k}"}
        try:
            captures, material, drawn = lab.draw(rng, *others)
            row |= {f"{DRAWN}{key}": value for key, value in drawn.items()}
            found = estimate_direct(captures, planned.options, known, radius_m=radius_m)
        except ValueError as error:
            rows.append(row | {"rejected": str(error)})
            continue
        truth, budget, values = truth_of(material), found.budget, found.quantities.values
        for quantity, (_, relative) in MODULI.items():
            one, true, at = found.moduli[quantity], truth[quantity], NAMES.index(quantity)
            gap = (np.log(true) if relative else true) - values[at]
            stem, known_truth = quantity.removesuffix("_pa"), np.isfinite(true)
            row |= dict(zip(columns(quantity), (one.value, one.low, one.high), strict=False))
            row[f"{stem}_error"] = one.value / true - 1 if relative else one.value - true
            row[f"{stem}_covered"] = one.low <= true <= one.high if known_truth else None
            row[f"{stem}_rank"] = student.cdf(gap / budget.std[at], budget.freedom[at])
        rows.append(row)
    return rows


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """`randomised_rigs.summary_of`, and how likely the truth's ranks are if they are even."""
    ranks = [table[f"{name.removesuffix('_pa')}_rank"].dropna() for name in MODULI]
    chances = [f"{kstest(one, 'uniform').pvalue:.2g}" for one in ranks]
    return summary_of(table).assign(**{"p of even ranks": chances})


def by_tenth(table: pd.DataFrame) -> pd.DataFrame:
    """How often intervals hold in each tenth of each quantity that was drawn."""
    parts, drawn = [], [name for name in table if name.startswith(DRAWN)]
    for name in MODULI:
        holds = table[f"{name.removesuffix('_pa')}_covered"].dropna().astype(float)
        for one in drawn:
            tenth = pd.qcut(table.loc[holds.index, one], 10, labels=False, duplicates="drop")
            of = holds.groupby(tenth).agg(["mean", "count"]).rename_axis("tenth").reset_index()
            parts.append(of.assign(drawn=one, quantity=name))
    return pd.concat(parts)


def main(argv: Sequence[str] | None = None) -> None:
    """Draw, estimate, write and print."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0], allow_abbrev=False)
    parser.add_argument("run", type=Path)
    parser.add_argument("--draws", type=int, default=50, help="of each object and sensor")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--ranges", type=Path, default=RANGES, help="YAML of what is drawn")
    given = parser.parse_args(argv)
    results = given.run / "results"
    pairs = [path.relative_to(results).parts[:2] for path in results.glob("*/*/direct.json")]
    pairs = [pair for pair in pairs if solved_points(results, pair[0])]
    if not pairs:
        expected = f"expected what `make validation` or `make results` leaves in {results}"
        parser.exit(1, f"error: run: {expected}, found no estimate of an object of the lab\n")
    try:
        ranges = load_yaml(given.ranges)
    except ValueError as error:
        parser.exit(1, f"error: ranges: {error}\n")
    seeded = given.draws, given.seed
    with ProcessPoolExecutor() as pool:
        jobs = [pool.submit(estimates, given.run, ranges, *pair, *seeded) for pair in sorted(pairs)]
        table = pd.DataFrame([row for job in jobs for row in job.result()])
    name = given.ranges.stem
    table.to_csv(results / f"{name}.csv", index=False)
    by_tenth(table).to_csv(results / f"{name}_by_tenth.csv", index=False)
    rejected = int(table["rejected"].notna().sum()) if "rejected" in table else 0
    print(summary(table).to_string(index=False))
    print(f"{rejected} of {len(table)} draws were rejected: {name}.csv says why")


if __name__ == "__main__":
    main()

"""Figure 4.4: a plane fitted to a vertex of a captured cloud and its neighbours."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from palpate.json_fields import read_all
from palpate.report.panels import named
from palpate.report.style import BLUE, GREEN, GREY, ORANGE, PAGE_IN, sensor_name
from palpate.surface.pose import to_object
from palpate.units import MILLIMETRES
from palpate.vision.clouds import Cloud, read_clouds
from scipy.spatial import cKDTree

from thesis.diagrams import TEXT_PT, Sketch, blank, legend_below, provenances, tangents
from thesis.panels import scale_bar
from thesis.views import View

# P lies so far from the pressed point, on the rim of the dent [m].
ASIDE_M = np.array([0.011, 0.0, 0.0])
SIDE = View(-62, 24)


@dataclass(frozen=True)
class PlaneFit:
    """Plane of a point's neighbours (Eq. 4.4-4.6).

    P and the mean of its neighbours (3,), the plane's unit normal (3,), the neighbours (n, 3), of
    which P is one, and the normal of P (3,) as the pipeline keeps it.
    """

    point_m: NDArray
    centre_m: NDArray
    normal: NDArray
    neighbours_m: NDArray
    kept_normal: NDArray

    @property
    def height_m(self) -> NDArray:
        """Distances of the neighbours from the plane, (n,) [m]."""
        return (self.neighbours_m - self.centre_m) @ self.normal

    @property
    def angle_deg(self) -> float:
        """Angle between the plane's normal and the kept one [deg]."""
        return float(np.rad2deg(np.arccos(np.clip(self.normal @ self.kept_normal, -1, 1))))


def fit_plane(cloud: Cloud, near_m: NDArray, *, neighbours: int) -> PlaneFit:
    """Fit a plane to the neighbours of the cloud's point nearest to a place.

    Parameters
    ----------
    cloud : Cloud
        A frame's points with the normals that the pipeline found.
    near_m : (3,) array
        Where to look for P, in the cloud's frame [m].
    neighbours : int
        ``clouds.normal_neighbours``; P counts.

    Returns
    -------
    PlaneFit

    Raises
    ------
    ValueError
        If the cloud has fewer points than that, or fewer than three are asked for.
    """
    if not 3 <= neighbours <= len(cloud.points_m):
        expected = f"neighbours: expected 3 to the cloud's {len(cloud.points_m)} points"
        raise ValueError(f"{expected}, found {neighbours}")
    tree = cKDTree(cloud.points_m)
    chosen = tree.query(near_m)[1]
    points = cloud.points_m[tree.query(cloud.points_m[chosen], neighbours)[1]]
    centre = points.mean(axis=0)
    normal = np.linalg.svd((points - centre).T)[0][:, 2]
    kept = cloud.normals[chosen] / np.linalg.norm(cloud.normals[chosen])
    normal = normal * (1.0 if normal @ kept >= 0 else -1.0)
    return PlaneFit(cloud.points_m[chosen], centre, normal, points, kept)


def _pressed_plane(cloud: Cloud, alignment: Mapping, neighbours: int) -> tuple[Cloud, PlaneFit]:
    """A frame's cloud in the object frame, and the plane at the rim of its dent."""
    pose = np.array(alignment["camera_from_object"])
    turned = Cloud(to_object(pose, cloud.points_m), cloud.normals @ pose[:3, :3])
    near = np.array(alignment["contact_point_m"]) + ASIDE_M
    return turned, fit_plane(turned, near, neighbours=neighbours)


def figure_4_4(inputs: Any, params: Any) -> Figure:
    """Plane fitted to a vertex and its neighbours in each capture's last cloud (Fig. 4.4)."""
    planes = [
        _pressed_plane(read_clouds(clouds)[-1], alignment, params.neighbours)
        for clouds, alignment in zip(inputs.clouds, read_all(inputs.alignments), strict=True)
    ]
    figure = plt.figure(figsize=(PAGE_IN, 4.3))
    captures, count = params.captures, len(params.captures)
    letters = iter("abcdefghijkl")
    for k, (capture, (cloud, fit)) in enumerate(zip(captures, planes, strict=True)):
        left, width = (k + 0.14) / count, 0.82 / count
        title, letter = sensor_name(capture["sensor"]), next(letters)
        space = blank(figure, (left, 0.5, width, 0.44), title, letter)
        _space(Sketch(space, SIDE), cloud, fit)
        side = figure.add_axes((left, 0.17, width, 0.24))
        _heights(side, fit)
        named(side, next(letters), "Distances from the plane")
    return legend_below(figure, figure.axes[0], provenances(params), lay_out=False)


def _space(sketch: Sketch, cloud: Cloud, fit: PlaneFit) -> None:
    """Points, plane and normal in space, from P."""
    P, axes = fit.point_m, sketch.axes
    reach = np.linalg.norm(fit.neighbours_m - P, axis=1).max()
    near = cloud.points_m[np.linalg.norm(cloud.points_m - P, axis=1) < 2.4 * reach]
    across, along = 1.15 * reach * tangents(fit.normal)
    centre, end = fit.centre_m - P, fit.centre_m - P + 1.3 * reach * fit.normal
    corners = [centre + a * across + b * along for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    axes.plot(*sketch.flat(near - P).T, ".", color=GREY, ms=2.6, mew=0, label="cloud")
    sketch.area(corners, GREEN, alpha=0.22, label="fitted plane")
    label = f"$P$ and its neighbours ({len(fit.neighbours_m)})"
    dots = sketch.flat(fit.neighbours_m - P)
    axes.plot(*dots.T, "o", color=BLUE, ms=3.2, mew=0, label=label)
    sketch.arrow(centre, end, color=GREEN, lw=1.4)
    sketch.name(end, r"$\mathbf{n}$", (1, 0.2), color=GREEN)
    sketch.dot(np.zeros(3), color=ORANGE, ms=5)
    sketch.name(np.zeros(3), "$P$", (-0.7, 1), 8, color=ORANGE)
    axes.autoscale_view()
    scale_bar(axes, 5, "5 mm")


def _heights(axes: Axes, fit: PlaneFit) -> None:
    """Distances from the plane, the sum of whose squares is least (Eq. 4.4)."""
    place = (fit.neighbours_m - fit.centre_m) @ tangents(fit.normal)[0] * MILLIMETRES
    height = fit.height_m * MILLIMETRES
    axes.axhline(0, color=GREEN, lw=1.2)
    axes.vlines(place, 0, height, color=BLUE, lw=0.7)
    axes.plot(place, height, "o", color=BLUE, ms=3.2, mew=0)
    axes.plot(place[0], height[0], "o", color=ORANGE, ms=5)
    words = f"rms {np.sqrt(np.mean(height**2)):.2f} mm;"
    words += f" {fit.angle_deg:.2f}° from the pipeline's normal"
    look = {"transform": axes.transAxes, "ha": "right", "va": "top", "fontsize": TEXT_PT}
    axes.text(1, 1, words, **look)
    largest = np.array([-1.15, 1.5]) * max(np.abs(height).max(), 0.1)
    axes.set(ylim=largest, xlabel="along the plane (mm)", ylabel="off the plane (mm)")

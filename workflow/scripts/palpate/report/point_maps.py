"""Stiffness over an object as its page shows it: by point, in words, and as a picture."""

from collections.abc import Iterable, Mapping, Sequence
from io import BytesIO
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from numpy.typing import NDArray

from palpate.modulus import Modulus
from palpate.point_map import FEWEST_POINTS, StiffnessMap, own_stds, stiffness_map
from palpate.report import style
from palpate.report.estimate_rows import points_by_group
from palpate.units import KILOPASCALS, MILLIMETRES, PERCENT

MAP = "cividis"
LABELS = "effective E* (kPa)", "half-width of the interval (%)"
# Height of a panel at most, and of what is below and above it.
HIGHEST_IN, AROUND_IN = 3.2, 1.0
# Light on faces that look to the side, as a part of that on those that face the reader.
SIDE_LIGHT = 0.7
CAPTION = (
    "Effective E* over the object: at the indented points (marks), and what follows for the surface"
    " between them; on the right the half-width of its 95 % interval. Colours go"
    " from the lowest to the highest end of the points' intervals. Far from all points the map is"
    " even because nothing was measured there, and its interval is wide."
)


class PointMap(NamedTuple):
    """What one sensor's captures found at the points of an object: moduli by point, and the map."""

    sensor: str
    points: Mapping[str, tuple[Modulus, float]]
    places_m: NDArray
    map: StiffnessMap | None

    def told(self) -> str:
        """One sentence."""
        name, count = style.sensor_name(self.sensor), len(self.points)
        if self.map is None:
            points = f"{count} point{'s' * (count != 1)}"
            return f"{name}: {points}, no map of stiffness; that takes {FEWEST_POINTS}."
        return f"{name}, {count} points: {self.map.homogeneity}."

    def rows(self) -> list[dict[str, str]]:
        """A row for each point, of a map."""
        moduli, parts = zip(*self.points.values(), strict=True)
        found = zip(self.points, self.places_m, moduli, own_stds(moduli, parts), strict=True)
        return [
            {
                "point": name,
                "place (mm)": ", ".join(f"{x:.0f}" for x in MILLIMETRES * place),
                "effective E* (95 % interval)": one.told(),
                "not shared": f"{PERCENT * std:.1f} %",
                "verdict": one.verdict,
            }
            for name, place, one, std in found
        ]


def point_maps(
    captures: Sequence[Mapping],
    singles: Sequence[Mapping],
    groups: Sequence[Mapping],
    places_m: Mapping[str, NDArray],
) -> list[PointMap]:
    """Maps of an object by sensor, of its captures and their direct.json; places (3,) by point."""
    found = []
    groups_points = points_by_group(captures, singles, groups)
    for group, points in zip(groups, groups_points, strict=True):
        places = np.array([places_m[name] for name in points]).reshape(-1, 3)
        enough = len(points) >= FEWEST_POINTS
        known = stiffness_map(places, *zip(*points.values(), strict=True)) if enough else None
        found.append(PointMap(group["sensor"], points, places, known))
    return found


def map_picture(
    maps: Sequence[PointMap], vertices_m: NDArray, faces: NDArray, provenances: set[str]
) -> bytes:
    """PNG of a row for each sensor with a map, on a template seen from the side of the points."""
    axes_of = [seen_along(one.places_m - vertices_m.mean(axis=0)) for one in maps]
    # Differences within the intervals are not to stand out.
    values = Normalize(*(KILOPASCALS * end for end in ends_of(one.map for one in maps)))
    with style.journal():
        wide, high = np.max([np.ptp(vertices_m @ axis, axis=0)[:2] for axis in axes_of], axis=0)
        row_in = min(style.COLUMN_IN * high / wide, HIGHEST_IN) + AROUND_IN
        look = {"figsize": (style.PAGE_IN, row_in * len(maps)), "layout": "constrained"}
        figure, axes = plt.subplots(len(maps), 2, squeeze=False, **look)
        for panels, one, axis in zip(axes, maps, axes_of, strict=True):
            value, low, high = one.map.at(vertices_m)
            half = PERCENT * (high - low) / (2 * value)
            of_half = Normalize(0, half.max())
            fields = (KILOPASCALS * value, values), (half, of_half)
            for panel, (field, scale), label in zip(panels, fields, LABELS, strict=True):
                _surface(panel, vertices_m @ axis, faces, field, scale)
                _points(panel, one, one.places_m @ axis)
                bar = plt.cm.ScalarMappable(scale, MAP)
                figure.colorbar(bar, ax=panel, label=label, location="bottom", aspect=35)
            panels[0].set_title(style.sensor_name(one.sensor))
        figure.get_layout_engine().set(rect=(0, 0.04, 1, 0.96))
        style.label_provenance(figure, provenances)
        content = BytesIO()
        figure.savefig(content, format="png", metadata={"Software": None})
        plt.close(figure)
    return content.getvalue()


def ends_of(maps: Iterable[StiffnessMap]) -> tuple[float, float]:
    """Least and greatest end of all points' intervals [Pa]: of a colour scale."""
    moduli = [one for each in maps for one in each.moduli]
    return min(one.low for one in moduli), max(one.high for one in moduli)


def seen_along(outward: NDArray) -> NDArray:
    """Right, up and towards the reader as columns (3, 3), of directions from which to look."""
    towards, above = outward.mean(axis=0), np.array([0.0, 0.0, 1.0])
    if np.linalg.norm(towards) < 1e-3 * np.linalg.norm(outward, axis=1).max():
        towards = above
    towards = towards / np.linalg.norm(towards)
    right = np.cross(above if abs(towards[2]) < 0.95 else [0.0, 1.0, 0.0], towards)
    right /= np.linalg.norm(right)
    return np.column_stack([right, np.cross(towards, right), towards])


def _surface(axes: Axes, seen_m: NDArray, faces: NDArray, field: NDArray, scale: Normalize) -> None:
    """Draw what faces the reader, the farthest first, coloured by a field of its vertices."""
    corners = MILLIMETRES * seen_m[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = normals[:, 2] / np.maximum(np.linalg.norm(normals, axis=1), 1e-12)
    order = np.argsort(corners[:, :, 2].mean(axis=1))
    order = order[facing[order] > 0]
    colours = colormaps[MAP](scale(field[faces[order]].mean(axis=1)))
    colours[:, :3] *= (SIDE_LIGHT + (1 - SIDE_LIGHT) * facing[order])[:, None]
    drawn = PolyCollection(corners[order, :, :2], facecolors=colours, edgecolors=colours, lw=0.3)
    axes.add_collection(drawn)
    axes.autoscale_view()
    axes.set(aspect="equal", xlabel="mm")


def _points(axes: Axes, one: PointMap, seen_m: NDArray) -> None:
    for name, (x, y, _) in zip(one.points, MILLIMETRES * seen_m, strict=True):
        axes.plot(x, y, "o", ms=4, mfc="white", mec=style.BLACK)
        look = {"fontsize": style.SMALL, "bbox": {"fc": "white", "alpha": 0.8, "lw": 0, "pad": 0.8}}
        axes.annotate(name, (x, y), (4, 4), textcoords="offset points", **look)

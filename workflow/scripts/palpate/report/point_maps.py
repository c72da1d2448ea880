"""Stiffness over an object as its page shows it: by point, in words, and as a picture."""

from collections.abc import Mapping, Sequence
from io import BytesIO
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from palpate.point_map import FEWEST_POINTS, StiffnessMap, stiffness_map
from palpate.report import style
from palpate.report.estimate_rows import points_by_group
from palpate.solid.mesh import doubled_normals
from palpate.units import KILOPASCALS, MILLIMETRES, PERCENT

MAP = "cividis"
LABELS = "effective E* (kPa)", "half-width of the interval (%)"
# Height of a panel at most, and of what is below and above it.
HIGHEST_IN, AROUND_IN = 3.2, 1.3


class PointMap(NamedTuple):
    """What one sensor's captures found at points of an object, and the map where these suffice."""

    sensor: str
    points: Sequence[str]
    map: StiffnessMap | None

    def text(self) -> str:
        """One sentence."""
        count = f"{len(self.points)} point{'s' * (len(self.points) != 1)}"
        found = self.map.homogeneity if self.map else f"a map of stiffness takes {FEWEST_POINTS}"
        return f"{style.sensor_name(self.sensor)}, {count}: {found}."

    def rows(self) -> list[dict[str, str]]:
        """A row for each point, of a map."""
        each = self.map.places_m, self.map.moduli, self.map.own_stds
        return [
            {
                "point": name,
                "place (mm)": ", ".join(f"{x:.0f}" for x in MILLIMETRES * place),
                "effective E* (95 % interval)": one.text(),
                "not shared": f"{PERCENT * std:.1f} %",
                "verdict": one.verdict,
            }
            for name, place, one, std in zip(self.points, *each, strict=True)
        ]


def point_maps(
    captures: Sequence[Mapping],
    singles: Sequence[Mapping],
    groups: Sequence[Mapping],
    places_m: Mapping[str, NDArray],
) -> list[PointMap]:
    """Maps of an object by sensor, of its captures and their direct.json; places (3,) by point."""
    found = []
    for group, points in zip(groups, points_by_group(captures, singles, groups), strict=True):
        known = None
        if len(points) >= FEWEST_POINTS:
            places = [places_m[name] for name in points]
            known = stiffness_map(places, *zip(*points.values(), strict=True))
        found.append(PointMap(group["sensor"], list(points), known))
    return found


def map_picture(
    maps: Sequence[PointMap], vertices_m: NDArray, faces: NDArray, provenances: set[str]
) -> bytes:
    """PNG of a row for each sensor with a map, on a template seen from the side of the points."""
    axes_of = [seen_along(one.map.places_m - vertices_m.mean(axis=0)) for one in maps]
    # Differences within the intervals are not to stand out.
    ends = [KILOPASCALS * end for one in maps for m in one.map.moduli for end in (m.low, m.high)]
    values = Normalize(min(ends), max(ends))
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
                _points(panel, one, axis, _ahead(one.map.places_m, vertices_m, faces) @ axis)
                bar = plt.cm.ScalarMappable(scale, MAP)
                figure.colorbar(bar, ax=panel, label=label, location="bottom", aspect=35)
            panels[0].set_title(style.sensor_name(one.sensor))
        figure.get_layout_engine().set(rect=(0, 0.04, 1, 0.96))
        style.label_provenance(figure, provenances)
        content = BytesIO()
        figure.savefig(content, format="png", metadata={"Software": None})
        plt.close(figure)
    return content.getvalue()


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
    seen = MILLIMETRES * seen_m
    order = np.argsort(seen[faces].sum(axis=1)[:, 2])
    order = order[doubled_normals(seen, faces)[order, 2] > 0]
    axes.tripcolor(*seen[:, :2].T, faces[order], field, norm=scale, cmap=MAP)
    axes.set(aspect="equal", xlabel="mm")


def _ahead(places_m: NDArray, vertices_m: NDArray, faces: NDArray) -> NDArray:
    """Normals of the faces nearest to places, (n, 3)."""
    nearest = cdist(places_m, vertices_m[faces].mean(axis=1)).argmin(axis=1)
    return doubled_normals(vertices_m, faces[nearest])


def _points(axes: Axes, one: PointMap, axis: NDArray, ahead: NDArray) -> None:
    """Points; those on the far side are hollow."""
    for name, place_m, towards in zip(one.points, one.map.places_m, ahead, strict=True):
        x, y, _ = MILLIMETRES * place_m @ axis
        axes.plot(x, y, "o", ms=4, mfc="white" if towards[2] > 0 else "none", mec=style.BLACK)
        look = {"fontsize": style.SMALL, "bbox": {"fc": "white", "alpha": 0.8, "lw": 0, "pad": 0.8}}
        axes.annotate(name, (x, y), (4, 4), textcoords="offset points", **look)

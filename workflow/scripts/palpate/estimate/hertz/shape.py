"""Which law of contact an object's shape under the sphere allows, and warnings against it.

K. L. Johnson, Contact Mechanics (1985), 4.2: two curved bodies, of unequal curvatures too.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import ellipe, ellipkm1
from trimesh.triangles import closest_point
from trimesh.triangles import normals as unit_normals

from palpate.estimate.hertz.laws import FOOT
from palpate.solid.smooth_surface import SmoothSurface
from palpate.solid.support import Support
from palpate.surface.alignment import thickness_along
from palpate.surface.template import Template
from palpate.units import MILLIMETRES, PERCENT

# Points of the surface that determine its curvature: rings about the contact, by its radius.
RINGS, AROUND = (1 / 3, 2 / 3, 1.0), 16
# A layer's faces are flat within this part of its thickness, as far as two contact radii or half of
# the thickness.
FLAT, LAYER_REACH, CONTACT_REACH = 0.05, 0.5, 2.0
# What leaves the object less than this part of its thickness above the plane stands on it.
LOW = 0.05
# A surface turned by more than 60 degrees from that in contact is a side, and free off the plane.
SIDE = np.cos(np.radians(60))
# See `side_part`.
SIDE_PART = 0.35
# No law holds where side or base change the force by more than this part.
LARGEST_PART = 0.05
# A surface bent by less than this part of how it is bent across is straight.
STRAIGHT = 0.05
# Curvatures that differ by less make a circle.
ROUND = 1 + 1e-4
INSTEAD = "trust the direct estimate"


@dataclass(frozen=True)
class Shape:
    """An object's shape as it changes the contact; by default a wide flat bonded layer.

    Attributes
    ----------
    support : {"half_space", "bonded", "not_bonded", "round_foot"}
        Of the law that comes nearest.
    curvature_per_m : float
        Of the sphere that makes the same contact as the object's surface [1/m].
    foot_curvature_per_m : float
        Of a round base on a plane, 0 where there is none [1/m].
    side_part : float
        Part of the force that a free side takes.
    warnings : tuple of str
        Warnings, a line each: why no law holds.
    """

    support: str = "bonded"
    curvature_per_m: float = 0.0
    foot_curvature_per_m: float = 0.0
    side_part: float = 0.0
    warnings: tuple[str, ...] = ()


def shape_at(
    template: Template,
    support: Support,
    point_m: NDArray,
    direction: NDArray,
    *,
    radius_m: float,
    depth_m: float,
) -> Shape:
    """Judge an object's shape where it is indented.

    At a touched point (3,) [m], along a direction (3,) in the object frame, by a sphere of a
    radius, to a maximum depth [m].

    Raises
    ------
    ValueError
        ``direction``: if it does not pass through the object.
    """
    surface = SmoothSurface(template.vertices_m, template.faces)
    contact = min(float(np.sqrt(radius_m * depth_m)), radius_m)
    up = _normal(surface, point_m, -direction / np.linalg.norm(direction), contact)
    thickness = thickness_along(template, point_m, -up)
    base = point_m - thickness * up
    borne = float(support.heights_m(base[None])[0]) < max(LOW * thickness, support.tolerance_m)
    foot, kind = 0.0, "half_space"
    if borne and _flat(surface, (point_m, base), up, contact, thickness):
        kind = "not_bonded" if support.resting else "bonded"
    elif borne and support.resting:
        low, high = principal_curvatures(surface, base, -up, contact)
        # A flat or a straight base has no contact of Hertz.
        if low > STRAIGHT * high:
            foot, kind = 1 / equivalent_radius(low, high), FOOT
    bend = 1 / radius_m + principal_curvatures(surface, point_m, up, contact)
    side = _side_m(template, support, point_m, up)
    part = side_part(side, contact, thickness if borne else np.inf)
    warnings = []
    if part > LARGEST_PART:
        warnings.append(
            f"a free side {MILLIMETRES * side:.2g} mm from the contact takes some"
            f" {PERCENT * part:.0f} % of the force: {INSTEAD}"
        )
    if kind == "half_space" and np.sqrt(radius_m * depth_m) / thickness > LARGEST_PART:
        warnings.append(
            f"the object is {MILLIMETRES * thickness:.2g} mm thick there, neither a layer that is"
            f" flat around the contact nor round on an unbonded base: {INSTEAD}"
        )
    if bend[0] <= 0:
        warnings.append(f"the surface is hollower than the sphere is round: {INSTEAD}")
        bend = np.full(2, 1 / radius_m)
    curvature = 1 / equivalent_radius(*bend) - 1 / radius_m
    return Shape(kind, curvature, foot, part, tuple(warnings))


def equivalent_radius(low_per_m: float, high_per_m: float) -> float:
    """Radius of the sphere on a plane with the compliance of an elliptic contact [m].

    With the ellipse's half axes a > b, m = 1 - b^2/a^2 and K, E the complete elliptic integrals of
    m, the curvatures have the ratio (E/(1 - m) - K)/(K - E), and F = 4/3 E* R^(1/2) d^(3/2) has R =
    pi^2 (K - E)/(2 low m K^3) (Johnson, 4.26 to 4.32, solved for the depth). Of the principal
    curvatures of both bodies together, both above 0 [1/m].
    """
    if high_per_m < ROUND * low_per_m:
        return float(2 / (low_per_m + high_per_m))

    def ratio(axes: float) -> float:
        K, E = ellipkm1(axes**2), ellipe(1 - axes**2)
        return (E / axes**2 - K) / (K - E) - high_per_m / low_per_m

    axes = brentq(ratio, 1e-6, 1 - 1e-6)
    K, E, m = ellipkm1(axes**2), ellipe(1 - axes**2), 1 - axes**2
    return float(np.pi**2 * (K - E) / (2 * low_per_m * m * K**3))


def side_part(side_m: float, contact_m: float, thickness_m: float) -> float:
    """Part of the force that a free side takes, x/(1 + x) with x = 0.35 a/c exp(-(2 c/h)^2).

    A mirror image of the contact, which frees the side of shear, adds 2/(3 pi) a/c to the depth;
    the pressure that it leaves adds more, and a base holds against both. Within 0.04 of finite
    elements of a block's edge (c of 6 to 25 mm, a of 2.6 to 5.3 mm, h 47.5 mm, nu 0.3). Of the
    distance c, contact radius a, and thickness h, infinite where no base holds the object [m].
    """
    if side_m <= 0:
        return 1.0
    held = float(np.exp(-((2 * side_m / thickness_m) ** 2)))
    return 1 - 1 / (1 + SIDE_PART * contact_m / side_m * held)


def principal_curvatures(
    surface: SmoothSurface, point_m: NDArray, normal: NDArray, reach_m: float
) -> NDArray:
    """Curvatures of a surface by a least-squares quadric, positive if convex, (2,) [1/m].

    Around a point (3,) [m] of the surface, with its outward normal there, up to ``reach_m`` [m].
    """
    rings = [_ring(point_m, normal, part * reach_m) for part in RINGS]
    places = np.concatenate([point_m[None], *rings])
    frame = np.stack([*_across(normal), normal], axis=1)
    x, y, z = ((surface.nearest(places) - point_m) @ frame).T
    columns = np.stack([x**2 / 2, x * y, y**2 / 2, x, y, np.ones_like(x)], axis=1)
    (xx, xy, yy), *_ = np.split(np.linalg.lstsq(columns, -z, rcond=None)[0], 2)
    return np.linalg.eigvalsh([[xx, xy], [xy, yy]])


def _normal(surface: SmoothSurface, point_m: NDArray, outward: NDArray, reach_m: float) -> NDArray:
    """Outward normal of the plane through the surface around a point, (3,)."""
    around = surface.nearest(_ring(point_m, outward, reach_m))
    normal = np.linalg.svd(around - around.mean(axis=0))[2][2]
    return normal * np.sign(normal @ outward)


def _flat(
    surface: SmoothSurface,
    places_m: tuple[NDArray, NDArray],
    up: NDArray,
    contact_m: float,
    thickness_m: float,
) -> bool:
    """Whether the surface around both places is flat, and square to a direction."""
    reach = max(CONTACT_REACH * contact_m, LAYER_REACH * thickness_m)
    rings = np.concatenate([_ring(at, up, part * reach) for at in places_m for part in RINGS])
    return bool(surface.distance(rings).max() < FLAT * thickness_m)


def _side_m(template: Template, support: Support, point_m: NDArray, up: NDArray) -> float:
    """Distance of the nearest free side or underside from a point [m]."""
    triangles = template.vertices_m[template.faces]
    held = support.holds(triangles.reshape(-1, 3)).reshape(-1, 3).all(axis=1)
    normals, whole = unit_normals(triangles)
    sides = triangles[whole][(normals @ up < SIDE) & ~held[whole]]
    near = closest_point(sides, np.broadcast_to(point_m, (len(sides), 3)))
    return float(np.linalg.norm(near - point_m, axis=1).min(initial=np.inf))


def _ring(point_m: NDArray, normal: NDArray, radius_m: float) -> NDArray:
    """Points around a point, across a direction, (k, 3) [m]."""
    turn = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)
    return point_m + radius_m * np.stack([np.cos(turn), np.sin(turn)], axis=1) @ _across(normal)


def _across(normal: NDArray) -> NDArray:
    """Two directions across one, (2, 3), all of length 1."""
    return np.linalg.svd(normal[None])[2][1:]

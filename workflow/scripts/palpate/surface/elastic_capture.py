"""Track one capture with the elastic tracker: mesh, noise, weight, every frame."""

import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.npz import Mapped
from palpate.open3d_core import ClosestPoints
from palpate.solid.mesh import refine_near
from palpate.solid.support import support_nodes
from palpate.surface.elastic import ElasticTracker, Fitted, Sphere, Table
from palpate.surface.options import ElasticTracking
from palpate.surface.pose import to_camera, to_object
from palpate.surface.template import Template, refine_template
from palpate.surface.tracked import Recorded, Tracked

# By whether the noise was reached; without points there is none.
RULES = {True: "discrepancy", False: "L-curve", None: "no points"}
# Weights that are tried, times the energy of Hertz's contact in the deepest frame. Under the first
# the points do little more than keep a body from rolling away under the sphere.
STRENGTHS = 10.0 ** np.arange(5.0, 1.9, -0.5)
# The corner of the L-curve lies behind where the product of misfit and energy is so much larger.
PAST_CORNER = 1.1
# Misfits this many times the noise's are no sensor's error.
EXCESS = 2.0
# Of the sphere's radius: its longest step between fits, and how deep a surface may leave it.
LONGEST_STEP, INSIDE = 0.4, 0.25
# How far above the noise a misfit may be, in standard deviations of the noise's own estimate.
ALLOWED = 2.0
# A frame at rest has its sphere so far from the surface [m].
CLEAR_M = 0.0005


@dataclass(frozen=True)
class Scene:
    """A capture of f frames in the object frame.

    Attributes
    ----------
    clouds : sequence of (points (n, 3) [m], normals (n, 3))
    spheres : list of Sphere
    depth_m : (f,) array
        Of the sphere below the undeformed surface [m].
    contact_m : (3,) array
    reach_m : float
        Points within it of the contact tell the misfit [m].
    rest : range
        Frames before the contact; the first one always.
    """

    clouds: Sequence
    spheres: list
    depth_m: NDArray
    contact_m: NDArray
    reach_m: float
    rest: range

    @property
    def deepest(self) -> int:
        """Frame in which the sphere is deepest."""
        return int(np.argmax(self.depth_m))


def track_by_elasticity(recorded: Recorded, options: ElasticTracking) -> Tracked:
    """Track with the elastic tracker.

    Parameters
    ----------
    recorded : Recorded
    options : ElasticTracking

    Returns
    -------
    Tracked
        Its prior tells Poisson's ratio, the weight and the rule that chose it, the noise and the
        frames that did not converge.

    Raises
    ------
    ValueError
        If no point of the first frame is near the template.
    """
    template, tracker = _tracker(recorded, options)
    scene = _scene(recorded, options.misfit_reach_m)
    tracker.learn_rest([scene.clouds[k] for k in scene.rest])
    weights = STRENGTHS / hertz_energy(scene, options.poisson_ratio)
    fits = _through(tracker, scene, weights[0] if options.points else np.inf)
    weight, reached = None, None
    if options.points:
        weight, reached = choose_weight(tracker, scene, fits[scene.deepest], weights)
        if weight != weights[0]:
            frames = zip(fits, scene.clouds, scene.spheres, strict=True)
            fits = [tracker.fit(*frame, weight) for frame in frames]
    pose, count = recorded.alignment.camera_from_object, len(template.vertices_m)
    prior = {
        "energy": "neo-Hookean",
        "poisson_ratio": options.poisson_ratio,
        "rule": RULES[reached],
        "weight_per_j": weight,
        "largest_weight_tried": bool(weight == weights[0]),
        "noise_reached": reached,
        "noise_m": tracker.sigma,
        "frames_at_rest": len(scene.rest),
        "frames_not_converged": [k for k, fit in enumerate(fits) if not fit.converged],
        "frames_sphere_inside": _inside(tracker, scene, fits),
    }
    return Tracked(
        template_m=template.vertices_m,
        faces=template.faces,
        rest_m=to_camera(pose, template.vertices_m),
        vertices_m=np.array([to_camera(pose, tracker.vertices(fit.nodes_m)) for fit in fits]),
        observed=np.array([fit.pairs.observed(count) for fit in fits]),
        camera_from_object=pose,
        residual_m=np.array([_rms(fit.pairs.distance_m) for fit in fits]),
        contact_point_m=recorded.alignment.contact_point_m,
        contact_frame=recorded.alignment.contact_frame,
        prior=json.dumps(prior),
    )


def hertz_energy(scene: Scene, nu: float) -> float:
    """Work of Hertz's contact (Eq. 5.1) to the deepest frame for E = 1 Pa [J].

    Raises
    ------
    ValueError
        If the sphere does not press the object.
    """
    depth, radius = float(scene.depth_m[scene.deepest]), scene.spheres[0].radius_m
    if depth <= 0:
        raise ValueError(
            f"tips: expected the sphere to press the object, found it {-depth * 1e3:.1f} mm away"
        )
    return 8 / 15 / (1 - nu**2) * np.sqrt(radius) * depth**2.5


def choose_weight(
    tracker: ElasticTracker, scene: Scene, fit: Fitted, weights: NDArray
) -> tuple[float, bool]:
    """Largest weight that explains the deepest frame as well as the frames at rest are.

    Morozov's discrepancy principle: the noise is the mean misfit of the frames at rest, with two
    standard deviations for what frames and points differ by; an offset at rest is that of the other
    frames, so one frame alone makes the noise too small. A sensor that errs more in a press
    than at rest would ask for a surface that follows its errors: once the misfit is within twice
    the noise the weight falls no further than to the least product of misfit and energy, which is
    a corner of the L-curve [1]_.

    Parameters
    ----------
    tracker : ElasticTracker
    scene : Scene
    fit : Fitted
        Deepest frame under the first weight.
    weights : (k,) array
        Weights of the elastic energy to try, falling [1/J].

    Returns
    -------
    weight : float
    reached : bool
        Whether the noise was reached.

    References
    ----------
    .. [1] T. Reginska, A regularization parameter in discrete ill-posed problems, SIAM J. Sci.
       Comput. 17 (1996).
    """
    allowed, tried = _noise(tracker, scene), []
    for weight in weights:
        if weight != weights[0]:
            frame = scene.clouds[scene.deepest], scene.spheres[scene.deepest]
            fit = tracker.fit(fit, *frame, weight)
        misfit = float(np.mean(tracker.costs(fit.pairs, scene.contact_m, scene.reach_m)))
        product = misfit * tracker.elastic.energy(fit.nodes_m)
        if misfit > EXCESS * allowed:
            continue
        tried.append((product, float(weight), misfit <= allowed))
        if misfit <= allowed or product > PAST_CORNER * min(tried)[0]:
            break
    _, weight, reached = min(tried, default=(0.0, float(weights[-1]), False))
    return weight, reached


def _noise(tracker: ElasticTracker, scene: Scene) -> float:
    """Largest misfit that noise explains."""
    seen = tracker.at_rest_seen
    costs = [tracker.costs(pairs, scene.contact_m, scene.reach_m) for pairs in seen]
    if not all(len(cost) for cost in costs):
        return 0.0
    between = np.var([cost.mean() for cost in costs])
    within = np.mean([cost.var() / len(cost) for cost in costs])
    return float(np.mean([cost.mean() for cost in costs]) + ALLOWED * np.sqrt(between + within))


def _through(tracker: ElasticTracker, scene: Scene, weight: float) -> list[Fitted]:
    """All frames, each from the one before."""
    fits, before = [tracker.at_rest()], None
    for cloud, sphere in zip(scene.clouds, scene.spheres, strict=True):
        start = fits[-1]
        for part in _on_the_way(before, sphere):
            start = tracker.fit(start, cloud, part, weight)
        fits.append(tracker.fit(start, cloud, sphere, weight))
        before = sphere
    return fits[1:]


def _on_the_way(before: Sphere | None, sphere: Sphere) -> list[Sphere]:
    """Spheres between two frames' where it moves far: nodes that it jumps over never touch it."""
    if before is None:
        return []
    way = sphere.centre_m - before.centre_m
    parts = int(np.linalg.norm(way) / (LONGEST_STEP * sphere.radius_m))
    return [
        Sphere(before.centre_m + way * k / (parts + 1), sphere.radius_m)
        for k in range(1, parts + 1)
    ]


def _inside(tracker: ElasticTracker, scene: Scene, fits: list[Fitted]) -> list[int]:
    """Frames in which the sphere lies deeper in the tracked surface than contact leaves it."""
    found = []
    for k, (fit, sphere) in enumerate(zip(fits, scene.spheres, strict=True)):
        if scene.depth_m[k] > 0:
            surface = ClosestPoints(tracker.vertices(fit.nodes_m), tracker.template.faces)
            depth = sphere.radius_m - surface.signed_distance(sphere.centre_m[None])[0]
            if depth > INSIDE * sphere.radius_m:
                found.append(k)
    return found


def _tracker(recorded: Recorded, options: ElasticTracking) -> tuple[Template, ElasticTracker]:
    contact, support = recorded.alignment.contact_point_m, recorded.support
    reach = options.refine_radius_m
    template = refine_template(
        recorded.template, contact, radius_m=reach, edge_m=options.refine_edge_m
    )
    solid = refine_near(
        recorded.solid,
        contact,
        radius_m=reach,
        edge_m=options.solid_edge_m,
        growth=options.solid_growth,
    )
    held, table = support_nodes(solid, support), Table(support.plane_point_m, support.up)
    return template, ElasticTracker(template, solid, held, table, options)


def _scene(recorded: Recorded, reach_m: float) -> Scene:
    pose, radius = recorded.alignment.camera_from_object, recorded.indenter_radius_m
    tips = to_object(pose, recorded.tips_m)
    surface = ClosestPoints(recorded.template.vertices_m, recorded.template.faces)
    depth = radius - surface.signed_distance(tips)
    # A soft object is deep under the sphere before its force is above the threshold.
    clear = depth[: max(1, recorded.alignment.contact_frame - 1)] < -CLEAR_M
    return Scene(
        clouds=Mapped(recorded.clouds, lambda c: (to_object(pose, c[0]), c[1] @ pose[:3, :3])),
        spheres=[Sphere(tip, radius) for tip in tips],
        depth_m=depth,
        contact_m=recorded.alignment.contact_point_m,
        reach_m=reach_m,
        rest=range(max(1, len(clear) if clear.all() else int(np.argmin(clear)))),
    )


def _rms(values: NDArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")

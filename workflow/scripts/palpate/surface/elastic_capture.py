"""Track one capture with the elastic tracker: mesh, noise, weight, every frame."""

import json
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.solid.boundary import support_nodes
from palpate.solid.refine import refine_around
from palpate.surface.distance import ClosestPoints
from palpate.surface.elastic import ElasticOptions, ElasticTracker, Fitted
from palpate.surface.obstacle import Sphere, Table
from palpate.surface.pose import to_camera, to_object
from palpate.surface.recorded import Recorded
from palpate.surface.template import Template, refine_template
from palpate.surface.tracked import Tracked

RULE = "discrepancy"
# Weights that are tried: times the elastic energy of the deepest frame under the largest one.
STRENGTHS = 10.0 ** np.arange(7.0, 1.9, -0.5)
# A misfit that no weight brings to the noise is taken where it has all but stopped to fall.
ALL_BUT = 1.05
# How far above the noise a misfit may be, in standard deviations of the noise's own estimate.
ALLOWED = 2.0


@dataclass(frozen=True)
class Scene:
    """A capture of f frames in the object frame.

    Attributes
    ----------
    clouds : list of (points (n, 3) [m], normals (n, 3))
    spheres : list of Sphere
    depth_m : (f,) array
        Of the sphere below the undeformed surface [m].
    contact_m : (3,) array
    reach_m : float
        Points within it of the contact tell the misfit [m].
    rest : range
        Frames before the contact; the first one always.
    """

    clouds: list
    spheres: list
    depth_m: NDArray
    contact_m: NDArray
    reach_m: float
    rest: range

    @property
    def deepest(self) -> int:
        """Frame in which the sphere is deepest."""
        return int(np.argmax(self.depth_m))


def track_by_elasticity(recorded: Recorded, options: Mapping) -> Tracked:
    """Track with the elastic tracker.

    Parameters
    ----------
    recorded : Recorded
    options : mapping
        Of the tracker, as config.yaml describes them.

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
    scene = _scene(recorded, options["misfit_reach_m"])
    tracker.learn_rest([scene.clouds[k] for k in scene.rest])
    stiff = _through(tracker, scene)
    weight, reached = choose_weight(tracker, scene, stiff[-1].nodes_m)
    fits = _again(tracker, scene, stiff, weight)
    pose, count = recorded.alignment.camera_from_object, len(template.vertices_m)
    prior = {
        "energy": "neo-Hookean",
        "poisson_ratio": options["poisson_ratio"],
        "rule": RULE,
        "weight_per_j": weight,
        "noise_reached": reached,
        "noise_m": tracker.sigma,
        "frames_not_converged": [k for k, fit in enumerate(fits) if not fit.converged],
    }
    return Tracked(
        template_m=template.vertices_m,
        faces=template.faces,
        rest_m=to_camera(pose, template.vertices_m),
        vertices_m=np.array([to_camera(pose, tracker.vertices(fit.nodes_m)) for fit in fits]),
        observed=np.array([fit.sight.observed(count) for fit in fits]),
        camera_from_object=pose,
        residual_m=np.array([_rms(fit.sight.distance_m) for fit in fits]),
        contact_point_m=recorded.alignment.contact_point_m,
        contact_frame=recorded.alignment.contact_frame,
        prior=json.dumps(prior),
    )


def choose_weight(tracker: ElasticTracker, scene: Scene, x: NDArray) -> tuple[float, bool]:
    """Largest weight that explains the deepest frame as well as the frames at rest are.

    Morozov's discrepancy principle: the noise is the mean misfit of the frames at rest, with two
    standard deviations for what frames and points differ by. Where no weight reaches it, it is
    the largest one whose misfit is within a twentieth of the smallest.

    Parameters
    ----------
    tracker : ElasticTracker
    scene : Scene
    x : (n, 3) array
        Node positions in the deepest frame, without any points [m].

    Returns
    -------
    weight : float
        Of the elastic energy for E = 1 Pa [1/J].
    reached : bool
        Whether the noise was reached.

    Raises
    ------
    ValueError
        If the sphere does not press the object.
    """
    energy, allowed, misfits = tracker.elastic.energy(x), _noise(tracker, scene), []
    if not 0 < energy < np.inf:
        raise ValueError("tips: expected the sphere to press the object, found it never does")
    for weight in STRENGTHS / energy:
        fit = tracker.fit(x, scene.clouds[scene.deepest], scene.spheres[scene.deepest], weight)
        x = fit.nodes_m
        misfits.append(tracker.costs(fit.sight, scene.contact_m, scene.reach_m).mean())
        if misfits[-1] <= allowed:
            return float(weight), True
    enough = np.flatnonzero(np.array(misfits) <= ALL_BUT * min(misfits))[0]
    return float(STRENGTHS[enough] / energy), False


def _noise(tracker: ElasticTracker, scene: Scene) -> float:
    """Largest misfit that noise explains."""
    sights = [tracker.see(tracker.rest, scene.clouds[k]) for k in scene.rest]
    costs = [tracker.costs(sight, scene.contact_m, scene.reach_m) for sight in sights]
    if not all(len(cost) for cost in costs):
        return 0.0
    between = np.var([cost.mean() for cost in costs])
    within = np.mean([cost.var() / len(cost) for cost in costs])
    return float(np.mean([cost.mean() for cost in costs]) + ALLOWED * np.sqrt(between + within))


def _through(tracker: ElasticTracker, scene: Scene) -> list[Fitted]:
    """Frames up to the deepest as contact and support alone make them."""
    x, fits = tracker.rest, []
    for k in range(scene.deepest + 1):
        fits.append(tracker.fit(x, scene.clouds[k], scene.spheres[k], np.inf))
        x = fits[-1].nodes_m
    return fits


def _again(
    tracker: ElasticTracker, scene: Scene, stiff: list[Fitted], weight: float
) -> list[Fitted]:
    """All frames with their points, from where they were without them or from the one before."""
    fits = []
    for k, (cloud, sphere) in enumerate(zip(scene.clouds, scene.spheres, strict=True)):
        start = stiff[k] if k < len(stiff) else fits[-1]
        fits.append(tracker.fit(start.nodes_m, cloud, sphere, weight))
    return fits


def _tracker(recorded: Recorded, options: Mapping) -> tuple[Template, ElasticTracker]:
    contact, support = recorded.alignment.contact_point_m, recorded.support
    reach = options["refine_radius_m"]
    template = refine_template(
        recorded.template, contact, radius_m=reach, edge_m=options["refine_edge_m"]
    )
    solid = refine_around(
        recorded.solid,
        contact,
        radius_m=reach,
        edge_m=options["solid_edge_m"],
        growth=options["solid_growth"],
    )
    point = np.array(support["plane_point_m"], dtype=float)
    normal = np.array(support["plane_normal"], dtype=float)
    held = support_nodes(
        solid, plane_point_m=point, plane_normal=normal, tolerance_m=support["tolerance_m"]
    )
    chosen = {name: options[name] for name in ElasticOptions.__dataclass_fields__}
    table = Table(point, normal / np.linalg.norm(normal))
    return template, ElasticTracker(template, solid, held, table, ElasticOptions(**chosen))


def _scene(recorded: Recorded, reach_m: float) -> Scene:
    pose, radius = recorded.alignment.camera_from_object, recorded.indenter_radius_m
    tips = to_object(pose, recorded.tips_m)
    surface = ClosestPoints(recorded.template.vertices_m, recorded.template.faces)
    return Scene(
        clouds=[(to_object(pose, p), n @ pose[:3, :3]) for p, n in recorded.clouds],
        spheres=[Sphere(tip, radius) for tip in tips],
        depth_m=radius - surface.signed_distance(tips),
        contact_m=recorded.alignment.contact_point_m,
        reach_m=reach_m,
        rest=range(max(1, recorded.alignment.contact_frame - 1)),
    )


def _rms(values: NDArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")

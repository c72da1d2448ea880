"""From one capture to what its estimates compare, in memory: the way of the workflow's stages."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from palpate.capture.capture import Capture
from palpate.capture.images import Stream
from palpate.capture.tables import columns_of
from palpate.estimate.direct.motion import SurfaceMotion, observed_motion, rest_frames
from palpate.estimate.hertz.indentation import Indentation, force_onset, indentation_of
from palpate.npz import Film
from palpate.press import Press, press_of
from palpate.solid.fill import object_solid
from palpate.solid.indentation_table import IndentationModel
from palpate.solid.load_steps import point_table
from palpate.solid.mesh import SolidMesh
from palpate.solid.options import IndentationTable
from palpate.surface.alignment import Alignment, align_first, resting_prior
from palpate.surface.elastic_capture import track_by_elasticity
from palpate.surface.options import ElasticTracking
from palpate.surface.tracked import Recorded, Tracked
from palpate.vision.background import build_model
from palpate.vision.clouds import Cloud, Reach, clouds_of, read_clouds, save_clouds
from palpate.vision.foreground import load_masks, masks_of, save_masks
from palpate.vision.probe import AXIS
from palpate.workflow.options import Config


@dataclass(frozen=True, repr=False)
class Measurement(Press):
    """What one capture tells, from its pictures and its force record.

    Attributes
    ----------
    capture, config, sensor, plane, poses, wrenches, path, clock
        Of `Press`, as are ``template``, ``support``, ``tips_m``, ``forces_n`` and ``tip_std_m``.
    masks : sequence of (h, w) bool array or None
        Foreground of each frame; None of a sensor of clouds. It and the clouds lie in temporary
        files that end with the measurement, so that recordings of any length fit.
    clouds : sequence of (points (n, 3) [m], normals (n, 3))
        One for each frame, camera frame.
    alignment : Alignment
    motion : SurfaceMotion
    files : TemporaryDirectory
        Of masks and clouds.

    Examples
    --------
    >>> from palpate import open_capture, measure
    >>> folder = "tests/sample/raw/foam_block/kinect/08"
    >>> found = measure(open_capture(folder, sensors="tests/sample/sensors"))
    >>> found.masks[0].shape, len(found.clouds), found.alignment.contact_frame
    ((480, 640), 10, 5)
    >>> print(f"tips known to {1e6 * found.tip_std_m:.0f} um")
    tips known to 165 um
    """

    masks: Film | None
    clouds: Film
    alignment: Alignment
    motion: SurfaceMotion
    files: TemporaryDirectory

    def __repr__(self) -> str:
        frames, folder = len(self.poses), self.capture.folder
        return f"Measurement({folder}: {frames} frames, contact in {self.alignment.contact_frame})"

    def curve(self) -> tuple[NDArray, NDArray]:
        """Depth [m] and force along the press [N] up to the deepest, (n,) each."""
        press = _indentation(self, self.alignment)
        return press.depth_m[press.approach], press.force_n[press.approach]


def measure(
    capture: Capture, config: Config | None = None, *, optics: str | Path | None = None
) -> Measurement:
    """Work out a capture: masks, probe, forces, clouds, alignment, motion of the surface.

    Parameters
    ----------
    capture : Capture
    config : Config, optional
        The options of all steps.
    optics : path, optional
        calibration.json of the sensor, where its own file's optics don't hold.

    Returns
    -------
    Measurement

    Raises
    ------
    ValueError
        Naming what was expected and found, where a picture, the force or the template does not fit.

    Examples
    --------
    >>> from palpate import open_capture
    >>> folder = "tests/sample/raw/foam_block/kinect/08"
    >>> found = measure(open_capture(folder, sensors="tests/sample/sensors"))
    >>> depth_m, force_n = found.curve()
    >>> print(f"{1e3 * depth_m[-1]:.1f} mm deep, {force_n[-1]:.1f} N")
    7.9 mm deep, 1.9 N
    """
    press = press_of(capture, config or Config(), optics)
    # A bad template or support is rejected before the masks.
    read = {"template": press.template, "support": press.support}
    masks, files = _masks(press), TemporaryDirectory(prefix="palpate-")
    if masks is not None:
        save_masks(path := Path(files.name, "mask.npz"), masks)
        masks = load_masks(path)
    save_clouds(path := Path(files.name, "clouds.npz"), _clouds(press, masks))
    clouds = read_clouds(path)
    alignment = _aligned(press, clouds[0])
    known, tips = (press.template, alignment), press.tips_m
    least, radius = press.config.hertz.onset_force_n, {"radius_m": capture.radius_m}
    rest = rest_frames(*known, tips, press.forces_n, onset_force_n=least, **radius)
    probe, options = (tips, columns_of(press.poses, AXIS)), press.config.direct.observation
    motion = observed_motion(*known, clouds, probe, rest, press.sensor, options, **radius)
    seen = {"masks": masks, "clouds": clouds, "alignment": alignment, "motion": motion}
    of_press = {field.name: getattr(press, field.name) for field in fields(press)}
    found = Measurement(**of_press, **seen, files=files)
    vars(found).update(read)  # the files may change; what was measured does not
    return found


def solid_of(measured: Measurement, kept: str | Path | None = None) -> SolidMesh:
    """Solid of the object: a kept mesh, or one made anew of its template.

    Parameters
    ----------
    measured : Measurement
    kept : path, optional
        VTU file.

    Raises
    ------
    ValueError
        If the kept mesh is not the template's.

    Examples
    --------
    >>> from palpate import open_capture, measure
    >>> folder = "tests/sample/raw/foam_block/kinect/08"
    >>> measured = measure(open_capture(folder, sensors="tests/sample/sensors"))
    >>> solid = solid_of(measured, kept="config/meshes/foam_block.vtu")
    >>> solid.nodes_m.shape[1], solid.order
    (3, 1)
    """
    template, declared = measured.template, measured.capture.declared["template"]
    surface = (template.vertices_m, template.faces)
    return object_solid(*surface, declared, measured.support, kept=kept)[0]


def indentation_table(
    measured: Measurement, solid: SolidMesh, options: IndentationTable | None = None
) -> IndentationModel:
    """Force and surface of the pressed point by finite elements: minutes of computing.

    Parameters
    ----------
    measured : Measurement
    solid : SolidMesh
    options : IndentationTable, optional
        Those of the measurement's configuration by default.

    Examples
    --------
    >>> from palpate import IndentationTable, open_capture, measure
    >>> folder = "tests/sample/raw/foam_block/kinect/08"
    >>> measured = measure(open_capture(folder, sensors="tests/sample/sensors"))
    >>> solid = solid_of(measured, kept="config/meshes/foam_block.vtu")
    >>> coarse = {"poisson_ratios": (0.0, 0.49), "step_m": 0.004, "edge_m": 0.01, "growth": 2.0}
    >>> table = indentation_table(measured, solid, IndentationTable(**coarse))
    >>> table.laws, f"{1e3 * table.depth_m[-1]:.0f} mm"
    (('neo_hookean', 'blatz_ko'), '9 mm')
    """
    capture, template = measured.capture, measured.template
    of = measured.support, (template.vertices_m, template.faces), capture.declared_point
    size = {"radius_m": capture.radius_m, "deepest_m": capture.declared.get("deepest_m")}
    return point_table(solid, *of, options or measured.config.direct.model, **size)


def track(
    measured: Measurement, solid: SolidMesh, options: ElasticTracking | None = None
) -> Tracked:
    """Track the template through all frames.

    Parameters
    ----------
    measured : Measurement
    solid : SolidMesh
    options : ElasticTracking, optional

    Examples
    --------
    >>> from palpate import ElasticTracking, open_capture, measure
    >>> folder = "tests/sample/raw/foam_block/kinect/08"
    >>> measured = measure(open_capture(folder, sensors="tests/sample/sensors"))
    >>> solid = solid_of(measured, kept="config/meshes/foam_block.vtu")
    >>> coarse = ElasticTracking(refine_edge_m=0.01, solid_edge_m=0.01, solid_growth=2)
    >>> found = track(measured, solid, coarse)
    >>> moved_m = np.linalg.norm(found.vertices_m - found.vertices_m[0], axis=2)
    >>> len(found.vertices_m), found.contact_frame, f"{1e3 * moved_m.max():.0f} mm"
    (10, 5, '4 mm')
    """
    of_object, clouds = (measured.template, solid, measured.support), measured.clouds
    probe = measured.tips_m, measured.forces_n, measured.capture.radius_m
    recorded = Recorded(*of_object, clouds, *probe, measured.alignment)
    return track_by_elasticity(recorded, options or ElasticTracking())


def align(press: Press) -> Alignment:
    """Alignment of the first frame alone, compared with the first contact (Eq. 4.24): seconds.

    ``camera_from_object`` (4, 4) and, object frame, ``contact_point_m`` (3,) [m]; a `ValueError` as
    `measure` raises.
    """
    _ = press.template  # a bad one is rejected before the masks
    masks = _masks(press)
    first = masks and list(islice(masks, 1))
    (cloud,) = _clouds(press, first, frames=[0])
    alignment = _aligned(press, cloud)
    _indentation(press, alignment)
    return alignment


def _indentation(press: Press, alignment: Alignment) -> Indentation:
    """What Hertz takes of a capture, which rejects a tip that is not at the surface."""
    time_s, of = press.poses["time_s"].to_numpy(float), (press.template, press.support)
    probe = {"radius_m": press.capture.radius_m, "tip_std_m": press.tip_std_m}
    known = alignment, press.tips_m, press.forces_n, time_s
    return indentation_of(*of, *known, **probe, options=press.config.hertz)[0]


def _masks(press: Press) -> Iterator[NDArray] | None:
    if "cloud" in press.sensor:
        return None
    capture, options = press.capture, press.config.background
    rate = options.false_positive_rate
    model = build_model(Stream(capture.background, press.sensor), false_positive_rate=rate)
    return masks_of(Stream(capture.folder, press.sensor), model, options)


def _clouds(
    press: Press, masks: Sequence[NDArray] | None, frames: Sequence[int] | None = None
) -> Iterator[Cloud]:
    """Clouds of the chosen frames, or of all."""
    capture, tip_m = press.capture, press.tips_m[int(np.argmax(press.sizes_n))]
    position_m = capture.declared_point["position_m"]
    extent = press.support.extent_m(press.template.vertices_m, position_m)
    seen = press.sensor, capture.probe, masks, press.poses, Reach(tip_m, *extent, press.plane)
    return clouds_of(capture.folder, *seen, press.config.clouds, frames)


def _aligned(press: Press, cloud: Cloud) -> Alignment:
    sizes_n, capture = press.sizes_n, press.capture
    onset = force_onset(sizes_n, onset_force_n=press.config.hertz.onset_force_n)
    place = press.template, press.support, capture.declared_point, press.plane
    touch = press.tips_m, onset, int(np.argmax(sizes_n))
    resting = resting_prior(*place, *touch, indenter_radius_m=capture.radius_m)
    return align_first(press.template, cloud, resting, onset, press.config.tracking.alignment)

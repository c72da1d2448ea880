"""From one capture to what its estimates compare, in memory: the way of the workflow's stages."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.capture.capture import Capture
from palpate.capture.images import Stream
from palpate.capture.tables import columns_of
from palpate.estimate.direct.motion import SurfaceMotion, observed_motion, rest_frames
from palpate.estimate.hertz.indentation import Indentation, force_onset, indentation_of
from palpate.frames import Film
from palpate.press import Press, press_of
from palpate.solid.fill import object_solid
from palpate.solid.indentation_table import IndentationModel
from palpate.solid.load_steps import point_table
from palpate.solid.mesh import SolidMesh
from palpate.solid.options import IndentationTable
from palpate.solid.support import Support, read_support
from palpate.surface.alignment import Alignment, align_first, resting_prior
from palpate.surface.elastic_capture import track_by_elasticity
from palpate.surface.options import ElasticTracking
from palpate.surface.template import Template, read_template
from palpate.surface.tracked import Recorded, Tracked
from palpate.vision.background import build_model
from palpate.vision.clock import ClockOffset
from palpate.vision.clouds import Cloud, Reach, clouds_of, read_clouds, save_clouds
from palpate.vision.force import FORCE
from palpate.vision.foreground import load_masks, masks_of, save_masks
from palpate.vision.probe import ALONG_STD, AXIS, TIP
from palpate.workflow.options import Config


@dataclass(frozen=True, repr=False)
class Measurement:
    """What one capture tells, from its pictures and its force record.

    Attributes
    ----------
    capture : Capture
    template : Template
        Undeformed, object frame.
    support : Support
    plane : (4,) array
        The table, camera frame.
    masks : sequence of (h, w) bool array or None
        Foreground of each frame; None of a sensor of clouds. It and the clouds lie in temporary
        files that end with the measurement, so that recordings of any length fit.
    poses, wrenches, path : DataFrame
        probe_pose.csv, force.csv and path.csv of the results.
    clock : ClockOffset
        Force clock minus camera clock.
    clouds : sequence of (points (n, 3) [m], normals (n, 3))
        One for each frame, camera frame.
    alignment : Alignment
    motion : SurfaceMotion
    config : Config
        That it was worked out with.
    files : TemporaryDirectory
        Of masks and clouds.

    Examples
    --------
    >>> from palpate import open_capture, measure
    >>> capture = open_capture(
    ...     "tests/sample/raw/foam_block/kinect/08", sensors="tests/sample/sensors"
    ... )
    >>> found = measure(capture)
    >>> found.masks[0].shape, len(found.clouds), found.alignment.contact_frame
    ((480, 640), 10, 5)
    >>> print(f"tips known to {1e6 * found.tip_std_m:.0f} um")
    tips known to 165 um
    """

    capture: Capture
    template: Template
    support: Support
    plane: NDArray
    masks: Film | None
    poses: pd.DataFrame
    wrenches: pd.DataFrame
    path: pd.DataFrame
    clock: ClockOffset
    clouds: Film
    alignment: Alignment
    motion: SurfaceMotion
    config: Config
    files: TemporaryDirectory

    def __repr__(self) -> str:
        frames, folder = len(self.poses), self.capture.folder
        return f"Measurement({folder}: {frames} frames, contact in {self.alignment.contact_frame})"

    @property
    def tips_m(self) -> NDArray:
        """Centre of the sphere in each frame, camera frame, (f, 3) [m]."""
        return columns_of(self.poses, TIP)

    @property
    def forces_n(self) -> NDArray:
        """Force on the object in each frame, camera frame, (f, 3) [N]."""
        return columns_of(self.wrenches, FORCE)

    @property
    def tip_std_m(self) -> float:
        """Deviation of a tip along the probe's axis [m]."""
        return _tip_std_m(self.poses)

    def curve(self) -> tuple[NDArray, NDArray]:
        """Depth [m] and force along the press [N] up to the deepest, (n,) each."""
        of = self.template, self.support
        press = _indentation(self.capture, self, of, self.alignment, self.config)
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
    >>> from palpate.capture.capture import open_capture
    >>> capture = open_capture(
    ...     "tests/sample/raw/foam_block/kinect/08", sensors="tests/sample/sensors"
    ... )
    >>> found = measure(capture)
    >>> depth_m, force_n = found.curve()
    >>> print(f"{1e3 * depth_m[-1]:.1f} mm deep, {force_n[-1]:.1f} N")
    7.9 mm deep, 1.9 N
    """
    config = config or Config()
    press = press_of(capture, config, optics)
    template, support = _object(capture)
    files = TemporaryDirectory(prefix="palpate-")
    masks = _masks(capture, press, config)
    if masks is not None:
        save_masks(path := Path(files.name, "mask.npz"), masks)
        masks = load_masks(path)
    of = (template, support)
    each = _clouds(capture, press, of, masks, config)
    save_clouds(path := Path(files.name, "clouds.npz"), each)
    clouds = read_clouds(path)
    alignment = _aligned(capture, press, of, clouds[0], config)
    tips, axes = columns_of(press.poses, TIP), columns_of(press.poses, AXIS)
    least, radius = config.hertz.onset_force_n, capture.radius_m
    forces = columns_of(press.wrenches, FORCE)
    rest = rest_frames(template, alignment, tips, forces, radius_m=radius, onset_force_n=least)
    motion = observed_motion(
        template,
        alignment,
        clouds,
        (tips, axes),
        rest,
        press.sensor,
        config.direct.observation,
        radius_m=radius,
    )
    return Measurement(
        capture=capture,
        template=template,
        support=support,
        plane=press.plane,
        masks=masks,
        poses=press.poses,
        wrenches=press.wrenches,
        path=press.path,
        clock=press.clock,
        clouds=clouds,
        alignment=alignment,
        motion=motion,
        config=config,
        files=files,
    )


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
    >>> capture = open_capture(
    ...     "tests/sample/raw/foam_block/kinect/08", sensors="tests/sample/sensors"
    ... )
    >>> solid = solid_of(measure(capture), kept="config/meshes/foam_block.vtu")
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
    >>> capture = open_capture(
    ...     "tests/sample/raw/foam_block/kinect/08", sensors="tests/sample/sensors"
    ... )
    >>> measured = measure(capture)
    >>> coarse = IndentationTable(
    ...     poisson_ratios=(0.0, 0.49), step_m=0.004, edge_m=0.01, growth=2.0
    ... )
    >>> table = indentation_table(
    ...     measured, solid_of(measured, kept="config/meshes/foam_block.vtu"), coarse
    ... )
    >>> table.laws, f"{1e3 * table.depth_m[-1]:.0f} mm"
    (('neo_hookean', 'blatz_ko'), '9 mm')
    """
    declared = measured.capture.declared
    return point_table(
        solid,
        measured.support,
        (measured.template.vertices_m, measured.template.faces),
        declared["points"][measured.capture.point],
        options or measured.config.direct.model,
        radius_m=measured.capture.radius_m,
        deepest_m=declared.get("deepest_m"),
    )


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
    >>> capture = open_capture(
    ...     "tests/sample/raw/foam_block/kinect/08", sensors="tests/sample/sensors"
    ... )
    >>> measured = measure(capture)
    >>> solid = solid_of(measured, kept="config/meshes/foam_block.vtu")
    >>> coarse = ElasticTracking(refine_edge_m=0.01, solid_edge_m=0.01, solid_growth=2)
    >>> found = track(measured, solid, coarse)
    >>> moved_m = np.linalg.norm(found.vertices_m - found.vertices_m[0], axis=2)
    >>> len(found.vertices_m), found.contact_frame, f"{1e3 * moved_m.max():.0f} mm"
    (10, 5, '4 mm')
    """
    recorded = Recorded(
        measured.template,
        solid,
        measured.support,
        measured.clouds,
        measured.tips_m,
        measured.forces_n,
        measured.capture.radius_m,
        measured.alignment,
    )
    return track_by_elasticity(recorded, options or ElasticTracking())


def align(capture: Capture, press: Press, config: Config) -> Alignment:
    """Alignment of the first frame alone, held to the first contact (Eq. 4.24): seconds.

    Parameters
    ----------
    capture : Capture
    press : Press
        Of the same capture.
    config : Config
        That the press was worked out with.

    Returns
    -------
    Alignment
        ``camera_from_object`` (4, 4) and ``contact_point_m`` (3,), object frame [m].

    Raises
    ------
    ValueError
        As `measure` does.
    """
    of, masks = _object(capture), _masks(capture, press, config)
    first = masks and list(islice(masks, 1))
    (cloud,) = _clouds(capture, press, of, first, config, frames=[0])
    alignment = _aligned(capture, press, of, cloud, config)
    _indentation(capture, press, of, alignment, config)
    return alignment


def _indentation(
    capture: Capture,
    press: "Press | Measurement",
    of: tuple[Template, Support],
    alignment: Alignment,
    config: Config,
) -> Indentation:
    """What Hertz takes of a capture, which rejects a tip that is not at the surface."""
    return indentation_of(
        *of,
        alignment,
        columns_of(press.poses, TIP),
        columns_of(press.wrenches, FORCE),
        press.poses["time_s"].to_numpy(float),
        radius_m=capture.radius_m,
        tip_std_m=_tip_std_m(press.poses),
        options=config.hertz,
    )[0]


def _tip_std_m(poses: pd.DataFrame) -> float:
    return float(np.nanmedian(poses[ALONG_STD]))


def _object(capture: Capture) -> tuple[Template, Support]:
    template = read_template(capture.template, unit=capture.declared["template"]["unit"])
    return template, read_support(capture.declared["support"])


def _masks(capture: Capture, press: Press, config: Config) -> Iterator[NDArray] | None:
    if "cloud" in press.sensor:
        return None
    rate = config.background.false_positive_rate
    model = build_model(Stream(capture.background, press.sensor), false_positive_rate=rate)
    return masks_of(Stream(capture.folder, press.sensor), model, config.background)


def _clouds(
    capture: Capture,
    press: Press,
    of: tuple[Template, Support],
    masks: Sequence[NDArray] | None,
    config: Config,
    frames: Sequence[int] | None = None,
) -> Iterator[Cloud]:
    """Clouds of the chosen frames, or of all."""
    template, support = of
    position_m = capture.declared["points"][capture.point]["position_m"]
    peak = int(np.argmax(_sizes_n(press)))
    tip_m = columns_of(press.poses, TIP)[peak]
    reach = Reach(tip_m, *support.extent_m(template.vertices_m, position_m), press.plane)
    seen = press.sensor, capture.probe, masks, press.poses
    return clouds_of(capture.folder, *seen, reach, config.clouds, frames)


def _aligned(
    capture: Capture, press: Press, of: tuple[Template, Support], cloud: Cloud, config: Config
) -> Alignment:
    sizes_n = _sizes_n(press)
    onset = force_onset(sizes_n, onset_force_n=config.hertz.onset_force_n)
    place = *of, capture.declared["points"][capture.point], press.plane
    tips = columns_of(press.poses, TIP), onset, int(np.argmax(sizes_n))
    resting = resting_prior(*place, *tips, indenter_radius_m=capture.radius_m)
    return align_first(of[0], cloud, resting, onset, config.tracking.alignment)


def _sizes_n(press: Press) -> NDArray:
    return np.linalg.norm(columns_of(press.wrenches, FORCE), axis=1)

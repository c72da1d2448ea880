"""E and nu straight from clouds and forces of one or more captures."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from palpate.estimate.direct.estimate import DirectEstimate, estimate_direct
from palpate.estimate.direct.indentation import DirectIndentation
from palpate.estimate.direct.options import Fit, ProbeUncertainty
from palpate.estimate.direct.problem import ProbeRecord, direct_indentation
from palpate.measurement import Measurement
from palpate.open3d_core import ClosestPoints
from palpate.solid.indentation_table import IndentationModel
from palpate.solid.smooth_surface import SmoothSurface
from palpate.units import MILLIMETRES

# A table of another sphere is another force.
SAME_RADIUS = 1e-6
# Of a declared point and its table's, and of a template and the solid that is made of it.
SAME_POINT_M, SAME_SURFACE_M = 0.0005, 0.003


def estimate(
    measured: Sequence[Measurement], tables: Sequence[IndentationModel], options: Fit | None = None
) -> DirectEstimate:
    """Estimate E and nu of an object from one or more of its captures with one sensor.

    Parameters
    ----------
    measured : sequence of Measurement
    tables : sequence of IndentationModel
        Of the point that each was pressed at.
    options : Fit, optional
        That of the measurements' configuration by default.

    Returns
    -------
    DirectEstimate
        ``moduli`` holds intervals by name, ``youngs_modulus_pa`` and ``poisson_ratio`` among them.

    Raises
    ------
    ValueError
        If captures and tables don't belong together, or a record has too few frames.

    Examples
    --------
    >>> from palpate import IndentationTable, indentation_table, measure, open_capture, solid_of
    >>> folder = "tests/sample/raw/foam_block/kinect/08"
    >>> measured = measure(open_capture(folder, sensors="tests/sample/sensors"))
    >>> solid = solid_of(measured, kept="config/meshes/foam_block.vtu")
    >>> # Too coarse for its numbers to mean anything, but quick.
    >>> coarse = {"poisson_ratios": (0.0, 0.49), "step_m": 0.004, "edge_m": 0.01, "growth": 2.0}
    >>> table = indentation_table(measured, solid, IndentationTable(**coarse))
    >>> found = estimate([measured], [table]).moduli["youngs_modulus_pa"]
    >>> found.low < found.value < found.high
    True
    """
    captures = [one.capture for one in measured]
    if (count := len({one.folder.parent for one in captures})) != 1:
        raise ValueError(f"measured: expected captures of one object and sensor, found {count}")
    places = [one.folder.resolve() for one in captures]
    if twice := [place.name for place in places if places.count(place) > 1]:
        raise ValueError(f"measured: expected each capture once, found {twice[0]} again")
    for other, one in combinations(measured, 2):
        if np.array_equal(one.forces_n, other.forces_n):
            names = [each.capture.folder.name for each in (one, other)]
            found = f"{names[0]}, the same recording as {names[1]}"
            raise ValueError(f"measured: expected each recording once, found {found}")
    if len(tables) != len(measured):
        raise ValueError(f"tables: expected {len(measured)}, one a capture, found {len(tables)}")
    for one, table in zip(measured, tables, strict=True):
        _check_table(one, table, captures[0].radius_m)
    options, first = options or measured[0].config.direct.fit, captures[0]
    indentations = [_indentation(*of, options) for of in zip(measured, tables, strict=True)]
    known = ProbeUncertainty.of(first.probe, first.sensor.get("base"))
    return estimate_direct(indentations, options, known, radius_m=first.radius_m)


def _check_table(measured: Measurement, table: IndentationModel, radius_m: float) -> None:
    """Reject a table of another sphere, of another point, or of another object."""
    capture = measured.capture
    if not np.isclose(table.radius_m, radius_m, rtol=SAME_RADIUS):
        expected = f"one of the probe's {radius_m * MILLIMETRES:g} mm sphere"
        found = f"{table.radius_m * MILLIMETRES:g} mm"
        raise ValueError(f"tables: expected {expected}, found one of {found}")
    way = np.array(capture.declared_point["position_m"], dtype=float) - table.point_m
    # A table's point is where the sphere first touches on the declared line.
    apart = float(np.linalg.norm(way - (way @ table.direction) * table.direction))
    if apart > SAME_POINT_M:
        expected = f"expected one of point {capture.point}"
        found = f"{apart * MILLIMETRES:.1f} mm off it"
        raise ValueError(f"tables: {expected}, found one of a point {found}")
    surface = ClosestPoints(measured.template.vertices_m, measured.template.faces)
    off = float(np.abs(surface.signed_distance(table.surface_rest_m)).max())
    if off > SAME_SURFACE_M:
        found = f"one whose surface lies up to {off * MILLIMETRES:.1f} mm off it"
        raise ValueError(f"tables: expected one of this object's template, found {found}")


def _indentation(measured: Measurement, table: IndentationModel, options: Fit) -> DirectIndentation:
    capture, offset_s = measured.capture, measured.clock.offset_s
    record = ProbeRecord.of(measured.path, capture.probe, capture.sensor, clock_offset_s=offset_s)
    surface = SmoothSurface(measured.template.vertices_m, measured.template.faces)
    motion, alignment = measured.motion, measured.alignment
    return direct_indentation(record, motion, alignment, surface, table, measured.support, options)

"""The file of an object: ``raw/<object>/object.yaml``."""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from palpate.config.model import FILL_IN, Length, Model, ObjectName, Vector, option, short, where

Metres = Annotated[float, Field(ge=-10, le=10)]
Place = tuple[Metres, Metres, Metres]
# The largest component is bounded: the length neither vanishes nor overflows.
Direction = Annotated[
    Vector,
    where(
        lambda vector: 1e-9 <= max(map(abs, vector)) <= 1e9,
        "a direction",
        lambda vector: short(vector) if any(vector) else "zeros",
    ),
]
Vertices = Annotated[int, Field(ge=20, le=100_000)]
Share = Annotated[float, Field(ge=0, le=0.4999)]
Shares = Annotated[
    tuple[Share, Share], where(lambda ends: ends[0] <= ends[1], "the lower before the higher")
]
PointName = Annotated[
    str, where("background".__ne__, "another name than that of the empty scene's folder", str)
]
Words = Annotated[str, Field(min_length=1)]


class TemplateSpec(Model, use_attribute_docstrings=True):
    """The undeformed object: a closed surface, or laser scans of which one is made."""

    file: Words = None
    """a closed surface, cut flat where the object stands: PLY, STL, OBJ or OFF"""
    scans: Literal["scans"] = option(None, "the folder of the scans")
    spacing_m: Length = option(None, "between points of the surface that is made of scans [m]")
    unit: Literal["m", "mm"] = option(..., "m or mm, of the template's coordinates", examples=["m"])
    vertices: Vertices = option(..., "of the solid mesh's surface; 500 to 1000 do", examples=[800])
    solid_vertices: Vertices = option(None, "of the solid; else as many")

    def conflicts(self) -> Iterator[tuple]:
        """Two sources, or none."""
        if (self.file is None) == (self.scans is None or self.spacing_m is None):
            yield "", "file, or scans and spacing_m", ", ".join(sorted(self.model_fields_set))


class SupportSpec(Model, use_attribute_docstrings=True):
    """The table that the object stands on."""

    plane_point_m: Place
    """a point of the table in the template's frame [m]; [0, 0, 0] if it stands on z = 0"""
    plane_normal: Direction = option(..., "its normal, into the object; [0, 0, 1] where z is up")
    tolerance_m: float = option(gt=0, le=0.02, examples=[0.001])
    """how near the table the template is held by it [m]"""
    contact: Literal["bonded", "resting"] = "bonded"
    """bonded (glued, taped, too heavy to move), or resting: loose on the table"""


class PointSpec(Model):
    """A point that is indented."""

    position_m: Place = option(..., "where on the template [m], to 5 mm (MeshLab: PickPoints)")
    direction: Direction = option(None, "into the object; else against the table's normal")


class CurvesSpec(Model, use_attribute_docstrings=True):
    """Of <point>.csv beside this file: force and position without a camera."""

    poisson_ratio: Share | Shares
    """assumed, like 0.45, or bounded, like [0.3, 0.49]: a curve does not determine it"""
    radius_m: Length = option(None, "the ball's radius [m]; else the probe's")
    stiffness_n_m: float = option(None, gt=0)
    """of what is compliant between drive and ball [N/m]; else the probe's"""
    depth_column: Words = option(None, "its name or number, where the header does not say it")
    force_column: Words = option(None, "its name or number, where the header does not say it")
    depth_unit: Words = option(None, "like mm, where the header does not say it")
    force_unit: Words = option(None, "like N, where the header does not say it")


class ObjectSpec(Model, use_attribute_docstrings=True):
    """An object: what it stands on, its template, and the points that are indented."""

    object: ObjectName = option(..., "a name of letters, digits and _, like red_sponge")
    provenance: Literal["recorded", "simulated"] = option(examples=["recorded"])
    """recorded, or simulated; every table repeats it"""
    probe: str = option(None, "a name of config/probes/<probe>.yaml; curves alone need none")
    template: TemplateSpec
    support: SupportSpec
    mirrors: tuple[Direction, ...] = option((), max_length=3)
    """normals of planes through plane_point_m that mirror the object"""
    deepest_m: Length = None
    """maximum depth [m]: the indentation table is then as fine as it needs"""
    points: dict[PointName, PointSpec] = option(
        ...,
        "one entry each: its name in quotes, letters and digits, as the captures' folders have it",
        min_length=1,
        examples=[{"01": {"position_m": [FILL_IN] * 3}}],
    )
    curves: CurvesSpec = None
    tracking: dict[str, float] = option(None, "empty: kept for later", max_length=0)

    def conflicts(self) -> Iterator[tuple]:
        """Two radii."""
        if self.probe is not None and self.curves and self.curves.radius_m is not None:
            yield "curves.radius_m", "none beside a probe, which has its own", "one"

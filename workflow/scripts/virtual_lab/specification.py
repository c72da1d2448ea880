"""What the lab's files may say: ``config/lab.yaml``, and ranges of randomised labs."""

from typing import Annotated, Any, Literal

from palpate.capture.discover import NOT_OBJECTS, OBJECT_NAME
from palpate.config.model import (
    Model,
    NotNegative,
    Positive,
    Ratio,
    Vector,
    all_different,
    where,
    with_others,
)
from palpate.config.object import SupportSpec
from pydantic import Field, create_model


def block(kind: type[Model] = Model, **fields: Any) -> type[Model]:
    """Model of a block: a type for each field, ``(type, None)`` if it may be left out."""
    return create_model("Block", __base__=kind, **fields)


def within(low: float, high: float, kind: type = float) -> Any:
    """Type of a number with two bounds."""
    return Annotated[kind, Field(ge=low, le=high)]


def whole(low: int) -> Any:
    """Type of an integer with a lower bound."""
    return Annotated[int, Field(ge=low)]


object_name = where(
    lambda name: name not in NOT_OBJECTS and OBJECT_NAME.fullmatch(name),
    f"a name of letters, digits and _ other than {' and '.join(NOT_OBJECTS)}, like red_sponge",
    str,
)
some = where(lambda value: value.model_fields_set, "at least one entry", lambda value: "none")
LAWS = ("neo_hookean", "blatz_ko", "gent", "hill_foam")
Share = within(0, 1)
BelowOne = Annotated[float, Field(ge=0, lt=1)]
Tilt, WideTilt, Tremor = within(0, 30), within(0, 60), within(0, 5)
Interval = tuple[Positive, Positive]
Sides = tuple[Positive, Positive, Positive]
Angles = Annotated[tuple[within(-360, 360), ...], Field(min_length=1)]
Names = Annotated[tuple[str, ...], Field(min_length=1), all_different]


class ErrorSizes(Model):
    """Errors of a rig: one standard deviation of each, if not said otherwise."""

    force_gain: NotNegative = None  # of each axis, relative
    force_crosstalk: NotNegative = None  # of each axis into each other, relative
    force_lag_s: NotNegative = None  # time constant of a first-order lag: itself, not random
    force_drift_n: NotNegative = None  # of each force from end to end of a record, by capture
    inertia: NotNegative = None  # of the sensor's payload, times what it is: not random
    clock_offset_s: NotNegative = None  # of the force's clock, besides timing's, by capture
    signs_alone: bool = None  # each error is one deviation, and its sign random
    burst: whole(1) = None  # samples of the force that share a stamp, the last one's
    clock_rate: NotNegative = None  # of the force's clock, relative
    focal: NotNegative = None  # of each camera, relative; a rectified pair has one
    principal_px: NotNegative = None  # along x and y of each camera; a rectified pair has one
    distortion_px: NotNegative = None  # of k1, p1 and p2 of each lens, at the picture's corner
    baseline: NotNegative = None  # relative, of a stereo head or to a depth camera's projector
    rectification_px: NotNegative = None  # right camera's pitch and yaw, and roll at the corner
    color_from_depth_deg: NotNegative = None  # about each axis
    color_from_depth_m: NotNegative = None  # along each axis
    exposure_s: NotNegative = None  # of the colour cameras, about a frame's stamp: not random
    depth_delay_s: NotNegative = None  # of a frame's depth after its colours: not random
    dropped_frames: within(0, 0.5) = None  # share, by capture
    light_change: NotNegative = None  # from the first frame to the last, relative, by capture
    shake_px: NotNegative = None  # of the colour pictures along x and y, from frame to frame
    radius: NotNegative = None  # of the sphere, relative
    mass_kg: NotNegative = None  # of the sensor's payload, beside force.mass_kg
    centre_of_mass_m: NotNegative = None  # of that, along each axis
    template_m: NotNegative = None  # smooth bumps of a template that is not scanned, by object
    declared_m: NotNegative = None  # of each point in object.yaml along x and y, by object


class Shape(Model):
    """Form of an object; a mesh is closed, z from below the table (z = 0), which cuts it."""

    kind: Literal["block", "ball", "ear", "mesh"]
    size_m: Sides = with_others("kind", "block")("of a block")
    radius_m: float = with_others("kind", "ball")("of a ball", gt=0)
    file: str = with_others("kind", "mesh")("the mesh", min_length=1)
    surface_m: float = with_others("kind", "mesh")("edges [m]", gt=0)


class MotionChanges(Model):
    """How the probe is moved, or what of it is different."""

    frames: whole(3) = None  # without it until the motion ends
    frame_rate_hz: Positive = None
    rest_s: Positive = None
    approach_s: Positive = None
    press_s: Positive = None
    hold_s: NotNegative = None  # at the maximum depth
    release_s: Positive = None  # back up as it came down; without it the probe stays
    approach_m: Positive = None
    depth_m: Positive = None
    pace_spread: within(0, 0.9) = None
    depth_spread: within(0, 0.9) = None
    tilt_deg: Tilt = None
    tilt_tremor_deg: NotNegative = None
    depth_tremor_m: NotNegative = None
    lateral_tremor_m: NotNegative = None
    contact_tremor_m: NotNegative = None  # in contact, without effect on the object
    bumped_deg: Vector = None  # of the camera about its axes, after the background
    jolted_m: Vector = None  # of the camera along its axes, after a third of the recording
    elbow_m: Vector = None  # of the operator's arm, from the tip in the probe's axes


MAY_LACK = {"frames", "hold_s", "release_s", "contact_tremor_m", "bumped_deg", "jolted_m"}
MAY_LACK |= {"elbow_m"}
Motion = block(
    MotionChanges,
    **{n: kind for n, kind in MotionChanges.__annotations__.items() if n not in MAY_LACK},
)
Placement = block(target_m=Vector, distance_m=Positive, elevation_deg=within(10, 80))
Paint = block(
    colour=tuple[Share, Share, Share],
    mottle=Share,
    mottle_m=Positive,
    dots=whole(0),
    dot_radius_m=Interval,
    gloss=NotNegative,
    shininess=Positive,
)
Material = block(
    law=Literal[LAWS],
    youngs_modulus_pa=Positive,
    poisson_ratio=Ratio,
    gradient=(Annotated[float, Field(gt=-1)], None),  # E at the table over that at the top, less 1
    # A stiffer layer on top of a block; youngs_modulus_pa is what is below it.
    skin=(block(thickness_m=Positive, stiffer=Positive), None),
    relaxation=block(fractions=tuple[BelowOne, ...], times_s=tuple[Positive, ...]),
)
Contact = block(
    step_m=Positive,
    deepest_m=Positive,
    element_m=Positive,
    growth=(Annotated[float, Field(gt=1)], None),
    reach_m=(Positive, None),
    spacing_m=(Positive, None),
    friction=NotNegative,
    glued=(Annotated[float, Field(gt=0, le=1)], None),  # part of a block's length and width
    straight=(Literal[True], None),  # in a block's middle, not inclined: a quarter is solved
    table_friction=(NotNegative, None),  # of a ball, or of an unbonded block
)
Template = block(
    vertices=whole(20),
    solid_vertices=(whole(20), None),
    scans=(Literal["scans"], None),
    spacing_m=(Positive, None),
)
# Direction: of the indentation, into the object; else down.
Point = block(position_m=Vector, direction=(Vector, None))
Described = block(
    probe=str,
    deepest_m=(Positive, None),
    mirrors=(Annotated[tuple[Vector, ...], Field(max_length=3)], None),
    template=Template,
    support=SupportSpec,
    points=Annotated[dict[str, Point], Field(min_length=1)],
)


class LabObject(Model):
    """An object, and its recordings."""

    shape: Shape
    rig: Annotated[str, Field(min_length=1)] = None  # whose errors it shares; else lab
    device: ErrorSizes = None  # in the place of the lab's
    devices: dict[str, ErrorSizes] = None  # by sensor, in their place
    seeded_as: dict[str, str] = None  # by sensor, another whose errors its recordings share
    table: Literal["plain"] = None  # of one colour and bare; else of wood, with things on it
    paint: Paint = None
    material: Material
    contact: Contact
    motion: Motion
    motions: dict[str, MotionChanges] = None  # by capture, what is different in its motion
    pressed_at: dict[str, Vector] = None  # by capture, another point than the declared one [m]
    cameras: dict[str, Placement]
    scan: block(distance_m=within(0.6, 2.5), turns_deg=Angles, elevations_deg=Angles)
    recordings: dict[str, Names]
    object: Described


OfSensors = block(sensors=Names, camera=Placement)
OfProbe = block(OfSensors, probe=str)
OfMotion = block(OfProbe, frame_rate_hz=Positive)
Experiments = {
    "calibration": block(
        OfSensors,
        squares=tuple[whole(4), whole(4)],
        square_m=Positive,
        pairs=whole(3),
        distance_m=Interval,
        tilt_deg=WideTilt,
    ),
    "workspace": block(
        OfProbe,
        **dict.fromkeys(("columns", "rows"), whole(1)),
        step_m=Positive,
        nearest_y_m=float,
        frames=whole(2),
        tilt_deg=Tilt,
    ),
    "cd_case": block(OfMotion, size_m=Sides, frames=whole(3), hand_m=NotNegative, tilt_deg=Tilt),
    "pivot": block(
        OfMotion, frames=whole(10), lean_deg=WideTilt, spin_deg=within(0, 90), tremor_deg=Tremor
    ),
    "load": block(
        OfMotion,
        poses=whole(2),
        hold_s=Positive,
        turn_s=Positive,
        lean_deg=WideTilt,
        tremor_deg=Tremor,
    ),
    "stiffness": block(
        OfMotion,
        **dict.fromkeys(("stiffness_n_m", "force_n", "press_s", "rest_s"), Positive),
        presses=whole(1),
        tilt_deg=Tilt,
        tremor_deg=Tremor,
    ),
    "loading": block(sensors=Names, object=str, point=str, motion=MotionChanges),
    "planes": block(
        OfSensors,
        size_m=Interval,
        tilt_deg=tuple[within(-30, 30), within(-30, 30)],
        frames=whole(2),
        distances_m=dict[str, Annotated[tuple[Positive, ...], Field(min_length=2)]],
    ),
}
# Of sensors that report a wrench: standard deviations, and the largest offset.
Wrench = block(**dict.fromkeys(("noise_n", "noise_nm", "offset_n", "offset_nm"), NotNegative))

# Of a robot's or a tracker's poses: clock's lag, standard deviations of a pose and of the base.
Followed = block(
    **dict.fromkeys(("latency_s", "noise_m", "noise_rad", "base_m", "base_rad"), NotNegative),
    rate_hz=Positive,
    force_rate_hz=(Positive, None),  # in the place of the lab's
    lost=(within(0, 0.5), None),  # share of rows; with it also a few in turn in the approach
    std_spread=(BelowOne, None),  # of each pose's own noise, relative, which is then written
)


class Lab(Model):
    """A lab: its sensors' noise, rigs, objects and experiments."""

    seed: whole(0)
    background_frames: whole(4)
    light: block(towards=Vector, key=NotNegative, ambient=NotNegative, spread_rad=NotNegative)
    camera_noise: block(
        read_variance=NotNegative, shot_variance=NotNegative, blur_px=Positive, flicker=NotNegative
    )
    kinect: block(
        noise=NotNegative,
        shot_noise=NotNegative,
        correlation=Share,
        distortion_px=NotNegative,
    )
    laser: block(turn_error_deg=NotNegative, shift_error_m=NotNegative)
    timing: block(clock_offset_s=NotNegative, frame_jitter_s=NotNegative)
    probe_error: block(angle_deg=NotNegative, shift_m=NotNegative)
    force: block(
        rate_hz=Positive,
        lead_s=NotNegative,
        noise_v=NotNegative,
        bias_v=NotNegative,
        mass_kg=NotNegative,
        centre_of_mass_m=Vector,
        wrench=(Wrench, None),
    )
    poses: dict[str, Followed] = None  # by the name of the base in a sensor's file
    device: ErrorSizes = None
    objects: dict[Annotated[str, object_name], LabObject]
    experiments: block(**{name: (kind, None) for name, kind in Experiments.items()}) = None
    simulated_block: block(
        mesh=str, lambda_pa=Positive, mu_pa=Positive, traction_pa=float, steps=whole(1)
    ) = None


def ends(kind: Any) -> Any:
    """Type of two numbers, the lower first."""
    return Annotated[tuple[kind, kind], where(lambda x: x[0] <= x[1], "the lower end first", list)]


Length = Annotated[float, Field(gt=0, le=1)]
Bounded = ends(Annotated[float, Field(gt=0, le=1e9)])
Lengths, Angle = ends(Length), ends(within(0, 80))


class Ranges(Model):
    """Ranges of randomised labs."""

    direct: dict[str, Any] = None  # of config.yaml, which says what may stand there
    objects: within(1, 1000, int)
    captures: within(1, 20, int)
    background_frames: within(4, 100, int)
    forms: Annotated[
        block(
            block=(block(weight=Positive, size_m=tuple[Lengths, Lengths, Lengths]), None),
            ball=(block(weight=Positive, radius_m=Lengths), None),
            ear=(block(weight=Positive), None),
        ),
        some,
    ]
    loose: Share
    table_friction: ends(Share)
    sphere_friction: ends(Share)
    material: block(
        law=Annotated[block(**dict.fromkeys(LAWS, (Positive, None))), some],
        youngs_modulus_pa=Bounded,
        poisson_ratio=ends(Ratio),
        relaxation_fraction=ends(Ratio),
        relaxation_times_s=tuple[Bounded, Bounded],
    )
    press: block(
        depth_over_radius=Bounded,
        force_n=Bounded,
        hold_s=ends(within(0, 60)),
        tilt_deg=Angle,
        contact_tremor_m=within(0, 0.01),
    )
    stand: block(distance_m=block(bumblebee=Bounded, kinect=Bounded), elevation_deg=Angle)
    device: block(ErrorSizes, force_gain=NotNegative, force_drift_n=NotNegative, radius=NotNegative)
    gloss: ends(Share)

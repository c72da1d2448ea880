"""What the lab's files may say: ``config/lab.yaml``, and ranges that labs are drawn from."""

from typing import Annotated, Any, Literal

from palpate.capture.discover import NOT_OBJECTS, OBJECT_NAME
from palpate.config.model import (
    Model,
    NotNegative,
    Positive,
    Ratio,
    Vector,
    all_different,
    with_others,
)
from palpate.config.object import SupportSpec
from pydantic import AfterValidator, Field, create_model


def block(kind: type[Model] = Model, **fields: Any) -> type[Model]:
    """Model of a block: a type for each field, ``(type, None)`` if it may be left out."""
    return create_model("Block", __base__=kind, **fields)


def within(low: float, high: float, kind: type = float) -> Any:
    """Type of a number with two bounds."""
    return Annotated[kind, Field(ge=low, le=high)]


def whole(low: int) -> Any:
    """Type of an integer with a lower bound."""
    return Annotated[int, Field(ge=low)]


def _object_name(name: str) -> str:
    if name in NOT_OBJECTS or not OBJECT_NAME.fullmatch(name):
        words = f"a name of letters, digits and _ other than {' and '.join(NOT_OBJECTS)}"
        raise ValueError(f"expected {words}, like red_sponge, found {name}")
    return name


def _some(value: Model) -> Model:
    if not value.model_fields_set:
        raise ValueError("expected at least one entry, found none")
    return value


Share = within(0, 1)
BelowOne = Annotated[float, Field(ge=0, lt=1)]
Tilt, Lean, Tremor = within(0, 30), within(0, 60), within(0, 5)
Words = Annotated[str, Field(min_length=1)]
Interval = tuple[Positive, Positive]
Sides = tuple[Positive, Positive, Positive]
Angles = Annotated[tuple[within(-360, 360), ...], Field(min_length=1)]
Names = Annotated[tuple[str, ...], Field(min_length=1), all_different]


class Device(Model):
    """A rig beside its files: one standard deviation of each error, if not said otherwise."""

    force_gain: NotNegative = None  # of each axis, relative
    force_crosstalk: NotNegative = None  # of each axis into each other, relative
    force_lag_s: NotNegative = None  # time constant of a first-order lag: itself, not drawn
    force_drift_n: NotNegative = None  # of each force from end to end of a record, by capture
    inertia: NotNegative = None  # of what hangs on the sensor, times what it is: not drawn
    clock_offset_s: NotNegative = None  # of the force's clock, besides timing's, by capture
    signs_alone: bool = None  # each error is one deviation, and its sign drawn
    burst: whole(1) = None  # samples of the force that share a stamp, the last one's
    clock_rate: NotNegative = None  # of the force's clock, relative
    focal: NotNegative = None  # of each camera, relative; a rectified pair has one
    principal_px: NotNegative = None  # along x and y of each camera; a rectified pair has one
    distortion_px: NotNegative = None  # of k1, p1 and p2 of each lens, at the picture's corner
    baseline: NotNegative = None  # relative, of a stereo head or to a depth camera's projector
    rectification_px: NotNegative = None  # right camera's pitch and yaw, and roll at the corner
    color_from_depth_deg: NotNegative = None  # about each axis
    color_from_depth_m: NotNegative = None  # along each axis
    exposure_s: NotNegative = None  # of the colour cameras, about a frame's stamp: not drawn
    depth_delay_s: NotNegative = None  # of a frame's depth after its colours: not drawn
    dropped_frames: within(0, 0.5) = None  # share, by capture
    light_change: NotNegative = None  # from the first frame to the last, relative, by capture
    shake_px: NotNegative = None  # of the colour pictures along x and y, from frame to frame
    radius: NotNegative = None  # of the sphere, relative
    mass_kg: NotNegative = None  # of what hangs on the sensor, beside force.mass_kg
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
    contact_tremor_m: NotNegative = None  # what is left in contact, which the object doesn't feel
    bumped_deg: Vector = None  # of the camera about its axes, since the background
    jolted_m: Vector = None  # of the camera along its axes, after a third of the recording
    elbow_m: Vector = None  # of the arm that holds the probe, from the tip in its axes


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
    pitch_m=(Positive, None),  # of a fine texture that repeats, in the mottle's place
    dots=whole(0),
    dot_radius_m=Interval,
    gloss=NotNegative,
    shininess=Positive,
)
Material = block(
    law=Literal["neo_hookean", "blatz_ko", "gent", "hill_foam"],
    youngs_modulus_pa=Positive,
    poisson_ratio=Ratio,
    gradient=(Annotated[float, Field(gt=-1)], None),  # E at the table over that at the top, less 1
    # A stiffer layer on top of a block; youngs_modulus_pa is what is below it.
    skin=(block(thickness_m=Positive, stiffer=Positive), None),
    mullins=(BelowOne, None),  # share of the force that a first indentation loses, on release
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
    glued=(Annotated[float, Field(gt=0, le=1)], None),  # of a block's base, of length and width
    straight=(Literal[True], None),  # in a block's middle, not inclined: a quarter is solved
    table_friction=(NotNegative, None),  # of a ball, or a block that stands loose
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
    rig: Words = None  # whose errors it shares; else lab
    device: Device = None  # in the place of the lab's
    devices: dict[str, Device] = None  # by sensor, in their place
    seeded_as: dict[str, str] = None  # by sensor, another whose draws its recordings share
    table: Literal["plain"] = None  # of one colour and bare; else of wood, with things on it
    paint: Paint = None
    material: Material
    contact: Contact
    motion: Motion
    motions: dict[str, MotionChanges] = None  # by capture, what is different in its motion
    pressed_at: dict[str, Vector] = None  # by capture, where the declared point is missed [m]
    pressed_along: dict[str, Vector] = None  # by capture, another direction than the declared one
    cameras: dict[str, Placement]
    scan: block(distance_m=within(0.6, 2.5), turns_deg=Angles, elevations_deg=Angles)
    recordings: dict[str, Names]
    object: Described


OfSensors = block(sensors=Names, camera=Placement)
OfProbe = block(OfSensors, probe=str)
Experiments = {
    "calibration": block(
        OfSensors,
        squares=tuple[whole(4), whole(4)],
        square_m=Positive,
        pairs=whole(3),
        distance_m=Interval,
        tilt_deg=Lean,
    ),
    "workspace": block(
        OfProbe,
        columns=whole(1),
        rows=whole(1),
        step_m=Positive,
        nearest_y_m=float,
        frames=whole(2),
        tilt_deg=Tilt,
    ),
    "cd_case": block(
        OfProbe,
        size_m=Sides,
        frames=whole(3),
        frame_rate_hz=Positive,
        hand_m=NotNegative,
        tilt_deg=Tilt,
    ),
    "pivot": block(
        OfProbe,
        frames=whole(10),
        frame_rate_hz=Positive,
        lean_deg=Lean,
        spin_deg=within(0, 90),
        tremor_deg=Tremor,
    ),
    "load": block(
        OfProbe,
        poses=whole(2),
        hold_s=Positive,
        turn_s=Positive,
        frame_rate_hz=Positive,
        lean_deg=Lean,
        tremor_deg=Tremor,
    ),
    "stiffness": block(
        OfProbe,
        stiffness_n_m=Positive,
        force_n=Positive,
        presses=whole(1),
        press_s=Positive,
        rest_s=Positive,
        frame_rate_hz=Positive,
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


class Lab(Model):
    """What a lab is made of."""

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
        whole_range=(bool, None),  # of the sensor is searched, not that of the scene alone
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
    device: Device = None
    objects: dict[Annotated[str, AfterValidator(_object_name)], LabObject]
    experiments: block(**{name: (kind, None) for name, kind in Experiments.items()}) = None
    simulated_block: block(
        mesh=str, lambda_pa=Positive, mu_pa=Positive, traction_pa=float, steps=whole(1)
    ) = None


def ends(kind: Any) -> Any:
    """Type of two numbers, the lower first."""
    return tuple[kind, kind]


Length = Annotated[float, Field(gt=0, le=1)]
Bounded = ends(Annotated[float, Field(gt=0, le=1e9)])
Lengths, Angle = ends(Length), ends(within(0, 80))


class Ranges(Model):
    """What labs are drawn from."""

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
        AfterValidator(_some),
    ]
    loose: Share
    table_friction: ends(Share)
    sphere_friction: ends(Share)
    material: block(
        law=Annotated[
            block(
                neo_hookean=(Positive, None),
                blatz_ko=(Positive, None),
                gent=(Positive, None),
                hill_foam=(Positive, None),
            ),
            AfterValidator(_some),
        ],
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
    device: block(Device, force_gain=NotNegative, force_drift_n=NotNegative, radius=NotNegative)
    gloss: ends(Share)

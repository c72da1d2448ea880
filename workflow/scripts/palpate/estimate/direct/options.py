"""Options of the direct estimate."""

from dataclasses import dataclass

from palpate.options import Options, block, option


@dataclass(frozen=True, kw_only=True)
class Observation(Options):
    """Motion of the surface's samples against the frames at rest."""

    spacing_m: float = option(0.004, "of two samples' seeds", above=0, most=0.2)
    reach_m: float = option(0.1, "of the farthest from the contact", above=0, most=0.2)
    largest_distance_m: float = option(
        0.012, "points farther from the undeformed surface belong to something else", above=0
    )
    largest_normal_deg: float = option(
        60.0, "so do those whose normals are turned more against its own", above=0, most=180
    )
    largest_view_deg: float = option(
        60,
        "between line of sight and normal: at a silhouette windows hold what is behind",
        above=0,
        most=90,
    )
    clear_m: float = option(
        0.018, "of lines of sight from the probe's axis: windows hold both nearer by", least=0
    )
    clear_windows: float = option(
        1.3, "of a stereo head: so many windows beside the tip, instead", least=0
    )
    shaft_clear_m: float = option(0.045, "the same beside the handle", least=0)
    shaft_from_m: float = option(0.05, "above the tip, where the handle begins", least=0)
    fewest_points: float = option(2, "of a sample in a frame; with fewer it was not seen", above=0)
    fewest_part: float = option(0.5, "nor with less than this part of its mean count", least=0)
    fewest_rest_frames: int = option(3, "in which a sample is seen", least=2)
    pictures: bool = option(
        False,
        "surface displacements across the lines of sight, seen in the pictures, are compared too:"
        " intervals may be too narrow; not where the reference camera sees a projector's pattern",
    )
    flow_window_m: float = option(
        0.014, "of the surface, side of the windows that are followed in the picture", above=0
    )
    largest_flow_std_px: float = option(
        0.25, "of them at rest: with more the surface has no texture there", above=0
    )
    near_m: float = option(
        0.04, "the camera must see some of the surface this near to the contact", above=0
    )


@dataclass(frozen=True, kw_only=True)
class ModelStd(Options):
    """Deviations of the indentation table."""

    log_youngs_modulus: float = option(0.015, "of log E", least=0)
    nu: float = option(0.01, "of Poisson's ratio", least=0)
    nu_loose: float = option(0.08, "the same where an object stands loose on a broad foot", least=0)


@dataclass(frozen=True, kw_only=True)
class Rig(Options):
    """Standard uncertainties of a rig that no press tells; what a careful lab reaches."""

    force_scale_std: float = option(0.01, "of the force sensor's scale", least=0)
    force_zero_std_n: float = option(0.003, "of what it reports unloaded", least=0)
    force_drift_std_n: float = option(0.01, "of that from a record's beginning to its end", least=0)
    force_axes_std_rad: float = option(0.01, "of its axes, which a force across tells", least=0)
    radius_std_m: float = option(0.00002, "of the sphere's radius", least=0, most=0.2)
    curvature_std_per_m: float = option(
        2.0, "of the template at the contact: 0.1 mm over 10 mm", least=0
    )
    board_scale_std: float = option(0.001, "of the side of the board's squares", least=0)
    compliance_std_m_n: float = option(
        2e-6, "of what the probe gives way by between board and tip, beside its file's", least=0
    )


@dataclass(frozen=True, kw_only=True)
class Fit(Options):
    """What is compared, what is held likely of a rig, and how the answer is judged."""

    least_force_share: float = option(
        0.05, "of the peak: frames with less are not compared", above=0, below=1
    )
    force_deviations: float = option(6, "of the force at rest, that it must exceed", above=0)
    nearest_radii: float = option(
        1.5, "samples nearer to the contact, in contact radii and metres, are left out", least=0
    )
    nearest_m: float = option(0.004, "the same in metres", least=0)
    farthest_m: float = option(0.1, "samples farther from it are left out", above=0, most=0.2)
    crease_m: float = option(
        0.01, "nearer to a sharp edge of the object windows hold two sides of it", least=0
    )
    patch_m: float = option(
        0.02,
        "of the surface; motions of different patches err independently",
        above=0,
        most=0.2,
    )
    relaxation_times_s: tuple[float, ...] = option(
        (0.2, 1.0, 5.0), "of the Prony series", above=0, fewest=1, unique=True
    )
    fraction_std: float = option(0.07, "of the share that relaxes with each of them", above=0)
    fraction_step_std: float = option(
        0.04, "of the difference between neighbouring times' shares", above=0
    )
    gain_std: float = option(
        0.01, "of the camera's distances: a calibrated one's scale is known to a percent", above=0
    )
    offset_std_m: float = option(
        0.003,
        "of the depth, from tip and alignment: a press tells it better than they do",
        above=0,
        most=0.2,
    )
    depth_pattern_std_m: float = option(
        0.00003,
        "of the depth, of what hangs on where the probe is: no frames more tell more of it",
        above=0,
        most=0.2,
    )
    shift_std_m: float = option(0.00003, "of all motions in common", above=0, most=0.2)
    place_std_m: float = option(
        0.001,
        "of the contact's place along the surface, of camera against probe",
        above=0,
        most=0.2,
    )
    picture_std_m: float = option(
        0.0015,
        "of places in the picture beside those of the depth, as of two cameras",
        above=0,
        most=0.2,
    )
    sinking_std_m: float = option(
        0.00001, "of what only stands: how far it goes down under the greatest force", least=0
    )
    rocking_std_rad: float = option(
        0.0002, "and rocks on its foot, beside the indentation table", least=0
    )
    foot_std: float = option(
        0.3,
        "of how freely a broad foot slides that stands loose, about half-way from stuck (0) to"
        " frictionless (1)",
        above=0,
    )
    youngs_modulus_bounds_pa: tuple[float, float] = option((100.0, 1e8), "of the fit", above=0)
    poisson_ratio_bounds: tuple[float, float] = option(
        (0.0, 0.4999), "of the fit; the table's, and up to 0.01 beyond", least=0, most=0.4999
    )
    poisson_ratio: float | None = option(
        None, "that is known beforehand; null where the press is to tell it", least=0, most=0.4999
    )
    poisson_ratio_std: float = option(0.002, "of it, where it is known", above=0, most=0.5)
    force_law_std: float = option(
        0.5,
        "of the place of the force's law between neo-Hooke's (0) and Blatz and Ko's (1)",
        above=0,
    )
    motion_law_std: float = option(1.0, "the same of the surface's motion", above=0)
    rig: Rig = block(Rig, "of errors that are no unknowns of the fit")
    model_std: ModelStd = block(ModelStd, "of the indentation table")

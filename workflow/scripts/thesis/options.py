"""Options of the study's own simulation."""

from typing import Literal

from palpate.config.model import Count, FileName, Model, Positive, option
from palpate.surface.options import Registration
from palpate.workflow.options import partly


class SimulatedSupport(Model):
    """What the simulated block is held by."""

    plane_point_m: tuple[float, float, float] = option((0, 0, 0), "of the support")
    plane_normal: tuple[float, float, float] = option((0, 0, 1), "of the support")
    tolerance_m: Positive = option(1.0e-6, "of nodes from it")


class SimulatedRegistration(Registration):
    """Registration of the block, by tracking error (tables/simulation_tracking.md).

    The error no longer falls with w_sm_stop.
    """

    w_sm: Positive = option(0.5, "first weight of the smoothness")
    w_sm_stop: Positive = option(
        0.01, "edges are 40 mm: more smoothness flattens a dent of three vertices"
    )
    data_term: Literal["point", "plane"] = option(
        "point", "Eq. 4.25 as printed; along the normal alone, sideways motion stays unseen"
    )
    data_points: Literal["nearest", "mean"] = option("nearest", "as printed: there is no noise")
    largest_normal_deg: float = option(
        90, "a box's corner and its sides are 55 degrees apart", gt=0, le=180
    )
    coarsest_vertices: Count = option(1000, "of the hierarchy, as printed", ge=1)


class Points(Model):
    """Points on the simulated surface."""

    cuts: int = option(60, "of an edge: 0.5 to 0.9 mm apart, a step is 0.3 mm", ge=1, le=200)
    corners: bool = option(True, "the moved vertices are among the points, as in the study")


class LinearMethod(Model):
    """The linear method (Section 3.3.2)."""

    starts_pa: tuple[tuple[Positive, Positive], ...] = option(
        ((1000, 1000), (10000, 50000), (50000, 10000), (200000, 20000), (1000000, 1000000)),
        "lambda and mu",
        min_length=1,
    )
    iterations: Count = option(500, "at most", ge=1)
    tolerance: Positive = option(1.0e-9, "relative change of (lambda, mu)")


class Noise(Model):
    """Noise on the exact displacements."""

    std_m: tuple[Positive, ...] = option(
        (1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3), "its deviations", min_length=1
    )
    repeats: Count = option(5, "draws of each", ge=1)


Variant = partly(Points, SimulatedRegistration)


class Simulation(Points):
    """The simulated block (Sections 3.3.2 to 3.3.4)."""

    support: SimulatedSupport = option(SimulatedSupport(), "of the block")
    tracking: SimulatedRegistration = option(SimulatedRegistration(), "of its surface")
    variants: dict[FileName, Variant] = option(
        {}, "of the above, to show what the estimates owe to the tracker"
    )
    linear: LinearMethod = option(LinearMethod(), "Section 3.3.2")
    noise: Noise = option(Noise(), "on the exact displacements")

"""Options of the study's own simulation."""

from dataclasses import dataclass, field
from typing import Any, Literal

from palpate.options import Options, block, option
from palpate.run.options import by_name, partly
from palpate.surface.options import Registration

STEPS = {"least": 1, "most": 200}


@dataclass(frozen=True, kw_only=True)
class SimulatedSupport(Options):
    """What the simulated block is held by."""

    plane_point_m: tuple[float, float, float] = option((0, 0, 0), "of the support")
    plane_normal: tuple[float, float, float] = option((0, 0, 1), "of the support")
    tolerance_m: float = option(1.0e-6, "of nodes from it", above=0)


@dataclass(frozen=True, kw_only=True)
class SimulatedRegistration(Registration):
    """Registration of the block, by tracking error (tables/simulation_tracking.md).

    The error no longer falls with w_sm_stop.
    """

    w_sm: float = option(0.5, "first weight of the smoothness", above=0)
    w_sm_stop: float = option(
        0.01,
        "edges are 40 mm: more smoothness flattens a dent of three vertices",
        above=0,
    )
    data_term: Literal["point", "plane"] = option(
        "point", "Eq. 4.25 as printed; along the normal alone, sideways motion stays unseen"
    )
    data_points: Literal["nearest", "mean"] = option("nearest", "as printed: there is no noise")
    largest_normal_deg: float = option(
        90, "a box's corner and its sides are 55 degrees apart", above=0, most=180
    )
    coarsest_vertices: int = option(1000, "of the hierarchy, as printed", least=1)


@dataclass(frozen=True, kw_only=True)
class Points(Options):
    """Points on the simulated surface."""

    cuts: int = option(60, "of an edge: 0.5 to 0.9 mm apart, a step is 0.3 mm", **STEPS)
    corners: bool = option(True, "the moved vertices are among the points, as in the study")


@dataclass(frozen=True, kw_only=True)
class LinearMethod(Options):
    """The linear method (Section 3.3.2)."""

    starts_pa: tuple[tuple[float, float], ...] = option(
        ((1000, 1000), (10000, 50000), (50000, 10000), (200000, 20000), (1000000, 1000000)),
        "lambda and mu",
        above=0,
        fewest=1,
    )
    iterations: int = option(500, "at most", least=1)
    tolerance: float = option(1.0e-9, "relative change of (lambda, mu)", above=0)


@dataclass(frozen=True, kw_only=True)
class Noise(Options):
    """Noise on the exact displacements."""

    std_m: tuple[float, ...] = option(
        (1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3), "its deviations", above=0, fewest=1
    )
    repeats: int = option(5, "draws of each", least=1)


@dataclass(frozen=True, kw_only=True)
class Simulation(Points):
    """The simulated block (Sections 3.3.2 to 3.3.4)."""

    support: SimulatedSupport = block(SimulatedSupport, "of the block")
    tracking: SimulatedRegistration = block(SimulatedRegistration, "of its surface")
    variants: dict[str, Any] = field(
        default_factory=dict,
        metadata={
            "meaning": "of the above, to show what the estimates owe to the tracker",
            "schema": by_name(partly(Points, SimulatedRegistration)),
        },
    )
    linear: LinearMethod = block(LinearMethod, "Section 3.3.2")
    noise: Noise = block(Noise, "on the exact displacements")

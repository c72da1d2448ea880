"""Options of the solids that computations are made on."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from palpate.options import Options, option

# Of Poisson's ratios: a table that comes near incompressibility serves beyond its last by so much.
NEARLY, BEYOND, LARGEST_RATIO = 0.48, 0.01, 0.4999


@dataclass(frozen=True, kw_only=True)
class Solid(Options):
    """Solid of the error minimisation (Section 3.3)."""

    refine_radius_m: float = option(0.020, "refined around the contact", above=0)
    refine_edge_m: float = option(0.007, "longest edges there", above=0)
    element_order: Literal[1, 2] = option(1, "2: ten-node tetrahedra, which do not lock")


@dataclass(frozen=True, kw_only=True)
class IndentationTable(Options):
    """Force and surface of a pressed point by finite elements at finite strain.

    Examples
    --------
    >>> IndentationTable(deepest_m=0.006).deepest_m
    0.006
    """

    poisson_ratios: tuple[float, ...] = option(
        (0.0, 0.2, 0.37, 0.49), "of the table's columns", least=0, most=0.495, fewest=2
    )
    deepest_m: float = option(
        0.009, "where object.yaml has no other; shallower tables are finer", above=0, most=0.2
    )
    step_m: float = option(0.0015, "between depths; finer at the start", above=0, most=0.2)
    edge_m: float = option(0.0025, "longest edges of elements at the contact", above=0, most=0.2)
    growth: float = option(0.8, "or this part of the distance from it", above=0)
    refine_radius_m: float = option(0.025, "refined around the contact", above=0, most=0.2)


def greatest_ratio(ratios: Sequence[float]) -> float:
    """Greatest Poisson's ratio that a table of some serves for.

    Force and displacement at a given depth are analytic in 1 - 2 nu up to incompressibility, where
    elements that are made to keep their volume would lock: the polynomials go on past the table.
    """
    return min(ratios[-1] + BEYOND, LARGEST_RATIO) if ratios[-1] >= NEARLY else ratios[-1]

"""Options of the solids that computations are made on."""

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from palpate.config.model import Length, Model, Positive, increasing, option

# Of Poisson's ratios: a table that comes near incompressibility serves beyond its last by so much.
NEARLY, BEYOND, LARGEST_RATIO = 0.48, 0.01, 0.4999

TabledRatio = Annotated[float, Field(ge=0, le=0.495)]


class Solid(Model):
    """Solid of the error minimisation (Section 3.3)."""

    refine_radius_m: Positive = option(0.020, "refined around the contact")
    refine_edge_m: Positive = option(0.007, "longest edges there")
    element_order: Literal[1, 2] = option(1, "2: ten-node tetrahedra, which do not lock")


class IndentationTable(Model):
    """Force and surface of a pressed point by finite elements at finite strain.

    Examples
    --------
    >>> IndentationTable(deepest_m=0.006).deepest_m
    0.006
    """

    poisson_ratios: Annotated[tuple[TabledRatio, ...], AfterValidator(increasing)] = option(
        (0.0, 0.2, 0.37, 0.49), "of the table's columns", min_length=2
    )
    deepest_m: Length = option(0.009, "where object.yaml has no other; shallower tables are finer")
    step_m: Length = option(0.0015, "between depths; finer at the start")
    edge_m: Length = option(0.0025, "longest edges of elements at the contact")
    growth: Positive = option(0.8, "or this part of the distance from it")
    refine_radius_m: Length = option(0.025, "refined around the contact")


def greatest_ratio(ratios: Sequence[float]) -> float:
    """Greatest Poisson's ratio that a table of some serves for.

    Force and displacement at a given depth are analytic in 1 - 2 nu up to incompressibility, where
    elements that are made to keep their volume would lock: the polynomials go on past the table.
    """
    return min(ratios[-1] + BEYOND, LARGEST_RATIO) if ratios[-1] >= NEARLY else ratios[-1]

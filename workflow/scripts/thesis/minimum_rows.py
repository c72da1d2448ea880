"""Rows of error minimisations: of a summary, and of the study's tables of moduli."""

from collections.abc import Iterator, Mapping, Sequence

from palpate.modulus import Modulus
from palpate.report.estimate_rows import row

E, NU, STAR = "youngs_modulus_pa", "poisson_ratio", "reduced_modulus_pa"


def minimum_rows(
    captures: Sequence[Mapping], minima: Mapping[tuple[str, str, str, str], Mapping]
) -> Iterator[dict]:
    """Minima of all captures and error options.

    Parameters
    ----------
    captures : sequence of mapping
    minima : mapping
        minimise-<error>.json by (object, sensor, capture, error).
    """
    for known, error, found in _known(captures, minima):
        profile, derived = found["profile"], found["least_squares"]["length"]
        ends = profile["interval"] or (None, None)
        yield row(
            known,
            f"minimise_{error}",
            _moduli(found) | {NU: Modulus(found[NU], *ends, profile["verdict"], "1")},
            error=error,
            hertz_reduced_modulus_pa=found["hertz_reduced_modulus_pa"],
            at_bound=found["at_bound"],
            youngs_modulus_std_pa=derived["youngs_modulus_std_pa"],
            poisson_ratio_std=derived["poisson_ratio_std"],
            poisson_ratio_reason=derived["unknown"],
        )


def least_squares_rows(
    captures: Sequence[Mapping], minima: Mapping[tuple[str, str, str, str], Mapping]
) -> Iterator[dict]:
    """Least squares of the same gaps."""
    for known, error, minimum in _known(captures, minima):
        found = minimum["least_squares"]["square"]
        more = {name: found[name] for name in ("youngs_modulus_std_pa", "poisson_ratio_std")}
        more["at_bound"] = found["at_bound"]
        yield row(known, f"least_squares_{error}", _moduli(found), **more)


def _known(captures: Sequence[Mapping], minima: Mapping) -> Iterator[tuple]:
    """Described capture, error option and minimum of each."""
    described = {(c["object"], c["sensor"], c["capture"]): c for c in captures}
    for (*capture, error), minimum in minima.items():
        yield described[tuple(capture)], error, minimum


def _moduli(found: Mapping) -> dict[str, Modulus]:
    units = {E: "Pa", NU: "1", STAR: "Pa"}
    return {name: Modulus(found[name], None, None, None, unit) for name, unit in units.items()}

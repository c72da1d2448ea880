"""Hertz fits of bare curves: force against depth."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.capture.curves.curve import Curve, read_curve
from palpate.capture.curves.phases import phases_of
from palpate.estimate.hertz.curve_fit import HertzFit, fit_curve
from palpate.estimate.hertz.curve_setup import Setup

if TYPE_CHECKING:
    from palpate.estimate.curve import CurveEstimate
    from palpate.estimate.direct.options import Fit
    from palpate.solid.indentation_table import IndentationModel

# A loading reaches over this part of a record's depths; larger steps are of samples in no order.
LOADED, LARGEST_STEP = 0.5, 0.2

__all__ = ["Curve", "HertzFit", "fit", "fit_shape", "read_curve"]


def fit(
    depth_m: ArrayLike,
    force_n: ArrayLike,
    *,
    radius_m: float | None = None,
    thickness_m: float | None = None,
    poisson_ratio: float = 0.33,
    indenter: str | None = None,
    half_angle_rad: float | None = None,
    object_radius_m: float | None = None,
    baseline: bool | None = None,
    residual: str = "force",
    weights: ArrayLike | None = None,
    stiffness_n_m: float | None = None,
    base: str = "bonded",
    contact_m: tuple[float, float] | None = None,
) -> HertzFit:
    """Fit E* and the depth of first contact to a curve (Eq. 5.1).

    Of a loading with an unloading before or after it the loading is fitted, and a warning says so.

    Parameters
    ----------
    depth_m, force_n : (n,) arrays
        Way of an indenter along its press from any zero [m] and force [N], up to the deepest;
        samples before contact help.
    radius_m : float, optional
        Of the sphere or the flat punch [m]; to be given but for a cone or a pyramid.
    thickness_m : float, optional
        Of a layer on a rigid base, under a sphere; a half-space by default.
    poisson_ratio : float, optional
        That a layer's correction and Young's modulus assume.
    indenter : {"parabola", "sneddon", "cone", "pyramid", "flat"}, optional
        By default Sneddon's sphere where the indentation is deeper than a tenth of the radius, else
        the paraboloid. A pyramid has four sides, a flat punch is a cylinder.
    half_angle_rad : float, optional
        Of a cone or a pyramid, between its axis and its side or face.
    object_radius_m : float, optional
        Of a curved object at the contact, negative where it is hollow; flat by default.
    baseline : bool, optional
        Fit a constant force too; by default where an approach tells it.
    residual : {"force", "force_two_thirds"}, optional
        What is compared: the force, or its power 2/3, in which Eq. 5.1 is straight.
    weights : (n,) array, optional
        Of the squared residuals.
    stiffness_n_m : float, optional
        Of what gives way between a drive, whose way the depth is, and the tip, such as a
        cantilever; stiff by default.
    base : {"bonded", "not_bonded"}, optional
        Whether a layer sticks to its base.
    contact_m : (float, float), optional
        Depth at which contact is expected, and that depth's standard deviation [m].

    Raises
    ------
    ValueError
        If an argument is out of its range, the force does not rise above its noise, or a layer is
        thinner than its series holds for.

    Examples
    --------
    >>> import numpy as np
    >>> depth_m = np.linspace(-1e-3, 5e-4, 60)
    >>> force_n = 4 / 3 * 20e3 * np.sqrt(6e-3) * np.maximum(depth_m - 1e-4, 0) ** 1.5
    >>> force_n += 1e-4 * np.random.default_rng(1).normal(size=60)
    >>> found = fit(depth_m, force_n, radius_m=6e-3)
    >>> print(f"E* {found.modulus_text}, contact at {1e3 * found.contact_m:.2f} mm")
    E* 19.85 kPa (95 %: 19.55 to 20.17), contact at 0.10 mm
    >>> print(f"{found.youngs_modulus_pa(0.3) / 1e3:.1f} kPa for nu 0.3; {found.quality}")
    18.1 kPa for nu 0.3; good fit, residuals of 0.52 % of the peak
    """
    depth, force = _curve(depth_m, force_n)
    given = None if weights is None else np.asarray(weights, dtype=float)
    if given is not None and not (given.shape == depth.shape and given.min() >= 0 < given.max()):
        raise ValueError("weights: expected one from 0 for each of depth_m, found others")
    tip = {"radius_m": radius_m, "indenter": indenter, "half_angle_rad": half_angle_rad}
    body = {"object_radius_m": object_radius_m, "thickness_m": thickness_m, "base": base}
    compared = {"baseline": baseline, "residual": residual, "contact_m": contact_m}
    setup = Setup(**tip, **body, **compared, poisson_ratio=poisson_ratio)
    phases = phases_of(depth, force)
    if stiffness_n_m is not None:
        if not 0 < stiffness_n_m < np.inf:
            raise ValueError(f"stiffness_n_m: expected above 0, found {stiffness_n_m}")
        depth = depth - force / stiffness_n_m
    loading, back = phases.loading, phases.retract.stop - phases.retract.start
    reach, step = np.ptp(depth[loading]), np.median(np.abs(np.diff(depth)))
    whole, one_way = np.ptp(depth), not (back or loading.start)
    if one_way or reach < LOADED * whole or step > LARGEST_STEP * whole:
        return fit_curve(depth, force, setup, given)
    given = None if given is None else given[loading]
    found = fit_curve(depth[loading], force[loading], setup, given)
    used = f"{loading.stop - loading.start} of {len(depth)} samples"
    note = f"the record has an unloading: its loading alone is fitted, {used}"
    return replace(found, notes=(*found.notes, note))


def fit_shape(
    found: HertzFit,
    table: "IndentationModel",
    poisson_ratio: tuple[float, float],
    options: "Fit | None" = None,
) -> "CurveEstimate":
    """Fit E to a curve by the object's own shape, where no half-space or layer is near it.

    Parameters
    ----------
    found : HertzFit
        Of the curve: where this starts from.
    table : IndentationModel
        Of the pressed point (`palpate.indentation_model`).
    poisson_ratio : (float, float)
        Least and greatest that the material may have.
    options : Fit, optional
        Of the direct estimate: what is held likely of the law, the rig and the table.

    Raises
    ------
    ValueError
        If the table is of another sphere, or holds neither the press's depth nor those ratios.

    Examples
    --------
    >>> import numpy as np
    >>> from palpate import Support, indentation_model, read_solid
    >>> from palpate.estimate.direct.table import force_table
    >>> from palpate.solid.indentation_setup import IndentationOptions
    >>> block = read_solid("config/meshes/foam_block.vtu")
    >>> ground = Support(np.zeros(3), np.array([0.0, 0.0, 1.0]), tolerance_m=1e-3)
    >>> point, down = np.array([-0.05, 0.0, 0.0475]), np.array([0.0, 0.0, -1.0])
    >>> press = {"radius_m": 6e-3, "deepest_m": 3e-3, "poisson_ratios": (0.0, 0.49)}
    >>> press |= {"options": IndentationOptions(edge_m=5e-3, growth=1.5)}  # coarse and quick
    >>> table = indentation_model(block, ground, point, down, **press)
    >>> depth_m = np.linspace(-1e-3, 2.9e-3, 80)
    >>> force_n = 20e3 * force_table(table).force(depth_m, 0.3, 0.0)
    >>> force_n += 1e-3 * np.random.default_rng(1).normal(size=80)
    >>> shape = fit_shape(fit(depth_m, force_n, radius_m=6e-3), table, (0.25, 0.35))
    >>> E = shape.moduli["youngs_modulus_pa"]
    >>> bool(E.low < 20e3 < E.high)
    True
    """
    from palpate.estimate.curve import estimate_curve
    from palpate.estimate.direct.options import Fit

    radius, setup = table.radius_m, found.setup
    other = setup.body != "sphere" or not np.isclose(setup.radius_m, radius)
    if other or setup.object_radius_m:
        raise ValueError(
            f"found: expected a fit of the table's sphere of {radius:g} m on what is flat, found"
            f" a {setup.body}, radius_m {setup.radius_m}, object_radius_m {setup.object_radius_m}"
        )
    return estimate_curve(found, table, poisson_ratio, options or Fit())


def _curve(depth_m: ArrayLike, force_n: ArrayLike) -> tuple[NDArray, NDArray]:
    depth, force = np.asarray(depth_m, dtype=float), np.asarray(force_n, dtype=float)
    if depth.ndim != 1 or depth.shape != force.shape:
        found = f"shapes {force.shape} and {depth.shape}"
        raise ValueError(f"force_n: expected one for each of depth_m, found {found}")
    if not (np.isfinite(depth).all() and np.isfinite(force).all()):
        raise ValueError("depth_m, force_n: expected finite numbers, found others")
    if not len(depth) or not np.ptp(depth) > 0 or not np.ptp(force) > 0:
        raise ValueError("depth_m, force_n: expected a press, found no change")
    if not np.cov(depth, force)[0, 1] > 0:
        raise ValueError("force_n: expected to rise with depth, found it to fall")
    return depth, force

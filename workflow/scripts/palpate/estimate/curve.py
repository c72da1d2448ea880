"""E of an object from one curve of force against depth, by the indentation table of its shape.

A curve determines one modulus and no more. Poisson's ratio is uniform within what is declared, and
the material-law parameter has a prior (docs/how_it_works.md): both widen the interval.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares
from scipy.special import stdtrit

from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.prior import FARTHEST_LAW
from palpate.estimate.direct.table import SampleTable, force_table
from palpate.estimate.hertz.curve_fit import HertzFit
from palpate.estimate.hertz.fit import LEVEL, deviation
from palpate.modulus import ASSUMED, Modulus
from palpate.solid.indentation_table import IndentationModel
from palpate.solid.options import greatest_ratio

# Unknowns: log E, contact over the indentation depth, baseline over the peak, nu, the material-law
# parameter of the force.
UNKNOWNS = 5
LOG_E, CONTACT, BASELINE, NU, LAW = range(UNKNOWNS)
# Deviation of what is taken for known, beside that of unknowns of size 1.
HELD, ROUNDS = 1e-9, 4
# So near to an end of its range, which the search does not reach, the law's parameter is at it.
AT_END = 1e-3
# Samples in contact: fewer determine no scatter.
FEWEST = 10


@dataclass(frozen=True)
class CurveEstimate:
    """Moduli of a curve.

    Attributes
    ----------
    moduli : dict of str to Modulus
        ``youngs_modulus_pa``, ``reduced_modulus_pa``, and ``poisson_ratio``, whose verdict is
        *assumed*.
    force_law, force_law_std : float
        Material-law parameter of the force, from neo-Hooke's (0) to Blatz and Ko's (1).
    contact_m, contact_std_m, press_m : float
        Depth at which contact begins, and the maximum indentation depth from there [m].
    baseline_n, rms_n : float
        Constant force, and root mean square of the residuals [N].
    fitted_n : (n,) array
        Force of the fit at the samples [N].
    warnings : tuple of str
        Warnings against trusting it, a line each.
    """

    moduli: dict[str, Modulus]
    force_law: float
    force_law_std: float
    contact_m: float
    contact_std_m: float
    press_m: float
    baseline_n: float
    rms_n: float
    fitted_n: NDArray
    warnings: tuple[str, ...]


def estimate_curve(
    hertz: HertzFit, model: IndentationModel, ratios: tuple[float, float], options: Fit
) -> CurveEstimate:
    """Estimate E of a curve.

    The Hertz fit is of the same curve: where this fit starts, and whether it has a baseline. The
    model is the indented point's, any Poisson's ratio between the least and the greatest of
    ``ratios`` as likely, and the options those of the direct estimate: its prior of the law, its
    rig and its table.

    Raises
    ------
    ValueError
        If the table holds neither the indentation depth nor those ratios.
    """
    least, greatest = float(model.poisson_ratios[0]), greatest_ratio(model.poisson_ratios)
    if not least <= ratios[0] <= ratios[1] <= greatest:
        expected = f"expected from {least:g} to {greatest:g}, low before high"
        raise ValueError(f"poisson_ratio: {expected}, found {list(ratios)}")
    if (count := hertz.samples_in_contact) < FEWEST:
        raise ValueError(f"samples: expected {FEWEST} or more in contact, found {count}")
    fit = _Fit(hertz, force_table(model), ratios, options)
    best = fit.best()
    covariance, law = np.linalg.inv(best.jac.T @ best.jac), float(best.x[LAW])
    depth, deepest = float(hertz.depth_m.max() - best.x[CONTACT] * hertz.press_m), model.depth_m[-1]
    if depth > deepest:
        expected = f"expected at least the curve's {1e3 * depth:.2f} mm"
        raise ValueError(f"deepest_m: {expected}, found a table of {1e3 * deepest:.2f} mm")
    # What a curve does not determine; its fit has a zero, and what is indented is as flat as known.
    nothing = dict.fromkeys(("force_zero_std_n", "force_drift_std_n", "curvature_std_per_m"), 0.0)
    of = {"force_n": float(np.ptp(hertz.fitted_n)), "radius_m": hertz.setup.radius_m}
    rig_std = options.rig.changed(**nothing).modulus_std(**of, depth_m=depth)
    stds = [options.model_std.log_youngs_modulus, options.model_std.sphere_friction]
    why = "the material has another law, or depths and forces contradict each other"
    line = f"material-law parameter of the force {law:+.2f}, an end of its range: {why}"
    return CurveEstimate(
        moduli=fit.moduli(best.x, covariance, float(np.linalg.norm([rig_std, *stds]))),
        force_law=law,
        force_law_std=float(np.sqrt(covariance[LAW, LAW])),
        contact_m=float(hertz.depth_m.max()) - depth,
        contact_std_m=float(np.sqrt(covariance[CONTACT, CONTACT])) * hertz.press_m,
        press_m=depth,
        baseline_n=float(best.x[BASELINE]) * fit.peak_n,
        rms_n=float(np.sqrt(np.mean((fit.force(best.x) - hertz.force_n) ** 2))),
        fitted_n=fit.force(best.x),
        warnings=(line,) if abs(law) > FARTHEST_LAW - AT_END else (),
    )


@dataclass(frozen=True)
class _Fit:
    """Least squares of a curve with what is held likely."""

    hertz: HertzFit
    table: SampleTable
    ratios: tuple[float, float]
    options: Fit

    @property
    def peak_n(self) -> float:
        return float(np.ptp(self.hertz.force_n))

    def force(self, x: NDArray) -> NDArray:
        """Force at the samples [N]; as beyond the table's end where they are deeper."""
        depth = self.hertz.depth_m - x[CONTACT] * self.hertz.press_m
        unit = self.table.force(depth, x[NU], x[LAW])
        return np.exp(x[LOG_E]) * unit + x[BASELINE] * self.peak_n

    def residual(self, x: NDArray) -> NDArray:
        """Force of the fit less that measured, by the roots of the samples' weights [N]."""
        weights = np.ones(1) if self.hertz.weights is None else self.hertz.weights
        return np.sqrt(weights / np.mean(weights)) * (self.force(x) - self.hertz.force_n)

    def best(self) -> OptimizeResult:
        """Least squares, in rounds by the scatter that they leave."""
        nu, found, std_n = np.mean(self.ratios), self.hertz, self.hertz.rms_n
        log_E, level = np.log(found.reduced_modulus_pa * (1 - nu**2)), found.baseline_n
        x = np.array([log_E, found.contact_m / found.press_m, level / self.peak_n, nu, 0.0])
        low = [*[-np.inf] * 3, self.ratios[0] - HELD, -FARTHEST_LAW]
        high = [*[np.inf] * 3, self.ratios[1] + HELD, FARTHEST_LAW]
        for _ in range(ROUNDS):
            std_n = max(std_n, HELD * self.peak_n)
            best = least_squares(self._gaps, x, bounds=(low, high), x_scale="jac", args=(std_n,))
            x, std_n = best.x, deviation(self.residual(best.x), UNKNOWNS)
        return best

    def moduli(self, x: NDArray, covariance: NDArray, rig_std: float) -> dict[str, Modulus]:
        """E and E* with their intervals, and nu as it is declared."""
        nu, found = float(x[NU]), {}
        level = float(stdtrit(self.hertz.samples_in_contact - UNKNOWNS, LEVEL))
        slopes = {"youngs_modulus_pa": 0.0, "reduced_modulus_pa": 2 * nu / (1 - nu**2)}
        for name, by_nu in slopes.items():
            slope = np.zeros(UNKNOWNS)
            slope[[LOG_E, NU]] = 1.0, by_nu
            width = level * float(np.hypot(np.sqrt(slope @ covariance @ slope), rig_std))
            log = x[LOG_E] - (np.log(1 - nu**2) if by_nu else 0.0)
            found[name] = Modulus.of_pascals(*(float(np.exp(log + s * width)) for s in (0, -1, 1)))
        return found | {"poisson_ratio": Modulus(nu, *self.ratios, ASSUMED, "1")}

    def _gaps(self, x: NDArray, std_n: float) -> NDArray:
        """Residuals and distances from what is held likely, in deviations."""
        low, high = self.ratios
        # A uniform distribution's deviation.
        nu_std = max((high - low) / np.sqrt(12), HELD)
        known = [(x[NU] - (low + high) / 2) / nu_std, x[LAW] / self.options.force_law_std]
        # Where no approach determines the constant, it is zero as well as a sensor's offset is.
        zero = self.options.rig.force_zero_std_n / self.peak_n
        known += [] if self.hertz.baseline else [x[BASELINE] / max(zero, HELD)]
        return np.r_[self.residual(x) / std_n, known]

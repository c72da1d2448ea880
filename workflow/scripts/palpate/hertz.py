"""Hertz fits of bare curves: force against depth."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.capture.columns import check_numbers
from palpate.capture.tables import read_table
from palpate.estimate.hertz.fit import ContactFit, fit_free_contact
from palpate.estimate.hertz.laws import LARGEST_CHI, contact_law
from palpate.estimate.hertz.models import SHALLOW

DEPTH, FORCE = "depth_m", "force_n"


@dataclass(frozen=True)
class HertzFit:
    """Reduced modulus of a curve.

    Attributes
    ----------
    reduced_modulus_pa : float
        E* = E / (1 - nu^2) [Pa].
    reduced_modulus_interval_pa : (float, float)
        Of 95 %, of the residuals' scatter alone [Pa].
    contact_m : float
        Depth at which contact begins [m].
    rms_n : float
        Of the residuals [N].
    indenter, support : str
        Law that was fitted.
    """

    reduced_modulus_pa: float
    reduced_modulus_interval_pa: tuple[float, float]
    contact_m: float
    rms_n: float
    indenter: str
    support: str

    def youngs_modulus_pa(self, poisson_ratio: float) -> float:
        """Young's modulus for a known Poisson's ratio [Pa].

        Raises
        ------
        ValueError
            If the ratio is not from 0 to 0.5.
        """
        _check_ratio(poisson_ratio)
        return self.reduced_modulus_pa * (1 - poisson_ratio**2)


def fit(
    depth_m: NDArray,
    force_n: NDArray,
    *,
    radius_m: float,
    thickness_m: float | None = None,
    poisson_ratio: float = 0.33,
    indenter: str | None = None,
    baseline: bool = False,
) -> HertzFit:
    """Fit E* and the depth of first contact to a curve (Eq. 5.1).

    Parameters
    ----------
    depth_m, force_n : (n,) arrays
        Way of a sphere along its press from any zero [m] and force [N], up to the deepest;
        samples before contact help.
    radius_m : float
        Of the sphere [m].
    thickness_m : float, optional
        Of a layer on a rigid base; a half-space by default.
    poisson_ratio : float, optional
        That a layer's correction assumes.
    indenter : {"parabola", "sneddon"}, optional
        By default Sneddon's sphere where the press is deeper than a tenth of the radius.
    baseline : bool, optional
        Fit a constant force too.

    Raises
    ------
    ValueError
        If an argument is out of its range, or a layer is thinner than its series holds for.

    Examples
    --------
    >>> import numpy as np
    >>> depth_m = np.linspace(-1e-3, 5e-4, 60)
    >>> force_n = 4 / 3 * 20e3 * np.sqrt(6e-3) * np.maximum(depth_m - 1e-4, 0) ** 1.5
    >>> found = fit(depth_m, force_n, radius_m=6e-3)
    >>> print(f"{found.reduced_modulus_pa:.0f} Pa, contact at {1e3 * found.contact_m:.2f} mm")
    20000 Pa, contact at 0.10 mm
    >>> print(f"{found.youngs_modulus_pa(0.3):.0f} Pa")
    18200 Pa
    """
    depth, force = _curve(depth_m, force_n)
    if not radius_m > 0:
        raise ValueError(f"radius_m: expected above 0, found {radius_m}")
    if thickness_m is not None and not thickness_m > 0:
        raise ValueError(f"thickness_m: expected above 0, found {thickness_m}")
    _check_ratio(poisson_ratio)
    if indenter is not None:
        return _fitted(depth, force, indenter, radius_m, thickness_m, poisson_ratio, baseline)
    first = _fitted(depth, force, "parabola", radius_m, thickness_m, poisson_ratio, baseline)
    if depth.max() - first.contact_m <= SHALLOW * radius_m:
        return first
    return _fitted(depth, force, "sneddon", radius_m, thickness_m, poisson_ratio, baseline)


def read_curve(path: str | Path) -> tuple[NDArray, NDArray]:
    r"""Read a CSV table with the columns ``depth_m`` and ``force_n``, (n,) arrays [m, N].

    Raises
    ------
    ValueError
        Naming file and column.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "curve.csv")
    ...     _ = path.write_text("depth_m,force_n\n0.0,0.0\n0.001,0.5\n")
    ...     read_curve(path)
    (array([0.   , 0.001]), array([0. , 0.5]))
    """
    table = read_table(path)
    missing = [name for name in (DEPTH, FORCE) if name not in table.columns]
    if missing:
        found = ", ".join(map(str, table.columns))
        raise ValueError(f"{path}: columns: expected {missing[0]}, found {found}")
    problems = check_numbers(Path(path), table, [DEPTH, FORCE])
    if problems:
        raise ValueError(problems[0])
    return table[DEPTH].to_numpy(float), table[FORCE].to_numpy(float)


def _check_ratio(poisson_ratio: float) -> None:
    if not 0 <= poisson_ratio <= 0.5:
        raise ValueError(f"poisson_ratio: expected from 0 to 0.5, found {poisson_ratio}")


def _curve(depth_m: NDArray, force_n: NDArray) -> tuple[NDArray, NDArray]:
    depth, force = np.asarray(depth_m, dtype=float), np.asarray(force_n, dtype=float)
    if depth.ndim != 1 or depth.shape != force.shape:
        raise ValueError(
            f"force_n: expected one for each of depth_m, found shapes {force.shape} and"
            f" {depth.shape}"
        )
    if not (np.isfinite(depth).all() and np.isfinite(force).all()):
        raise ValueError("depth_m, force_n: expected finite numbers, found others")
    if not len(depth) or not np.ptp(depth) > 0 or not np.ptp(force) > 0:
        raise ValueError("depth_m, force_n: expected a press, found no change")
    if not np.cov(depth, force)[0, 1] > 0:
        raise ValueError("force_n: expected to rise with depth, found it to fall")
    return depth, force


def _fitted(
    depth: NDArray,
    force: NDArray,
    indenter: str,
    radius_m: float,
    thickness_m: float | None,
    nu: float,
    baseline: bool,
) -> HertzFit:
    support = "half_space" if thickness_m is None else "bonded"
    thickness = np.inf if thickness_m is None else thickness_m
    law = contact_law(indenter, support, radius_m=radius_m, thickness_m=thickness, nu=nu)
    found = fit_free_contact(depth, force, law, baseline=baseline)
    chi = np.sqrt(radius_m * max(depth.max() - found.contact_depth_m, 0.0)) / thickness
    if chi > LARGEST_CHI:
        raise ValueError(
            f"thickness_m: expected a layer that sqrt(radius depth) is at most {LARGEST_CHI:g} of,"
            f" found {chi:.2g}"
        )
    return _shown(found, indenter, support)


def _shown(found: ContactFit, indenter: str, support: str) -> HertzFit:
    return HertzFit(
        found.reduced_modulus_pa,
        found.reduced_modulus_interval_pa,
        found.contact_depth_m,
        found.rms_n,
        indenter,
        support,
    )

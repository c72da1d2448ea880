"""All models of a press side by side, and the one that its geometry recommends."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.hertz import ContactFit, KnownContactFit, fit_free_contact, fit_known_contact
from palpate.estimate.hertz_laws import INDENTERS, LARGEST_CHI, SUPPORTS, contact_law

# Contact at the surface; wherever the force says; or at the surface within its stated deviation.
CONTACTS = ("known", "free", "weighted")
# Beyond this depth over radius the paraboloid is too blunt by more than a hundredth.
SHALLOW = 0.1
# Poisson's ratios of all that people press, from cork to rubber.
POISSON_RATIOS = (0.0, 0.499)


@dataclass(frozen=True)
class Press:
    """Samples of one press up to the end of deformation, and what they rest on.

    Attributes
    ----------
    depth_m, force_n : (n,) arrays
        Depth [m] and force [N], approach included.
    onset : int
        First sample in contact.
    radius_m, thickness_m : float
        Of the sphere, and of the object along the press [m].
    depth_std_m : float
        Standard deviation of an error that all depths share [m].
    """

    depth_m: NDArray
    force_n: NDArray
    onset: int
    radius_m: float
    thickness_m: float
    depth_std_m: float

    @property
    def depth_over_radius(self) -> float:
        """Largest depth over the sphere's radius."""
        return max(float(self.depth_m.max()), 0.0) / self.radius_m

    @property
    def chi(self) -> float:
        """Largest sqrt(R d)/h."""
        return self.radius_m * float(np.sqrt(self.depth_over_radius)) / self.thickness_m


def fit_models(
    press: Press, *, nu: float, baseline: bool, residual: str, series: str
) -> list[dict]:
    """Fit every model with the contact point known, free and weighted.

    Parameters
    ----------
    press : Press
    nu : float
        Poisson's ratio that the layers assume.
    baseline, residual
        Of `fit_free_contact`.
    series : {"consistent", "printed"}
        Of the layers.

    Returns
    -------
    list of dict
        ``indenter, support, contact``, the fit's fields, and for layers
        ``reduced_modulus_range_pa``, the moduli at Poisson's ratios 0 and 0.499. A layer that is
        thinner than the series holds for has none.
    """
    supports = SUPPORTS if press.chi <= LARGEST_CHI else SUPPORTS[:1]
    options = {"baseline": baseline, "residual": residual, "series": series}
    rows = []
    for indenter in INDENTERS:
        for support in supports:
            for contact in CONTACTS:
                name = {"indenter": indenter, "support": support, "contact": contact}
                row = name | vars(fit_model(press, **name, nu=nu, **options))
                if support != "half_space":
                    ends = [fit_model(press, **name, nu=end, **options) for end in POISSON_RATIOS]
                    row["reduced_modulus_range_pa"] = sorted(e.reduced_modulus_pa for e in ends)
                rows.append(row)
    return rows


def fit_model(
    press: Press,
    *,
    indenter: str,
    support: str,
    contact: str,
    nu: float,
    baseline: bool,
    residual: str,
    series: str,
) -> ContactFit | KnownContactFit:
    """Fit one model, with the contact point ``known``, ``free`` or ``weighted``."""
    law = contact_law(
        indenter,
        support,
        radius_m=press.radius_m,
        thickness_m=press.thickness_m,
        nu=nu,
        series=series,
    )
    if contact != "known":
        return fit_free_contact(
            press.depth_m,
            press.force_n,
            law,
            baseline=baseline,
            residual=residual,
            depth_std_m=press.depth_std_m if contact == "weighted" else None,
        )
    used = slice(press.onset, None)
    return fit_known_contact(
        press.depth_m[used], press.force_n[used], law, depth_std_m=press.depth_std_m
    )


def recommended(press: Press, models: Sequence[Mapping]) -> dict:
    """Choose a model by the press's geometry.

    Sneddon's sphere beyond a depth of a tenth of the radius, else the paraboloid; the bonded layer
    where the series holds, since everything downstream takes the support as fixed, else the
    half-space; and the weighted contact, since it leaves neither the surface nor the force unused.

    Returns
    -------
    dict
        The model, with ``rule`` in words.
    """
    indenter = "sneddon" if press.depth_over_radius > SHALLOW else "parabola"
    support = "bonded" if press.chi <= LARGEST_CHI else "half_space"
    wanted = (indenter, support, "weighted")
    best = next(m for m in models if (m["indenter"], m["support"], m["contact"]) == wanted)
    rule = (
        f"depth over radius {press.depth_over_radius:.2f}, chi {press.chi:.2f};"
        f" sneddon above {SHALLOW:g}, bonded up to chi {LARGEST_CHI:g}, contact weighted"
    )
    return dict(best) | {"rule": rule}

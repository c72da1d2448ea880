"""How an object that only stands goes down and rocks on its foot, beside what a model knows of it.

What is bonded does not. The shape of a foot that nobody saw, and how much of it sticks, move the
whole of a ball by a hundredth of a millimetre or two; a tenth of Poisson's ratio moves it by three.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.options import Fit
from palpate.solid.support import Support

# Sinking, and rocking about two axes.
MOTIONS = 3


@dataclass(frozen=True)
class SupportAxes:
    """Rigid motions of an object on its support when it bears the greatest force.

    Attributes
    ----------
    samples_m : (c, 3) array
        Of the samples along their normals, for a unit of each motion: 1 m, and 1 rad twice.
    tip_m : (3,) array
        Of the contact along the press.
    std : (3,) array
        Deviations of the motions about 0 [m, rad, rad]; 0 where there is none.
    """

    samples_m: NDArray
    tip_m: NDArray
    std: NDArray


def rocking_axes(up: NDArray) -> NDArray:
    """Two axes across a unit vector (3,), (2, 3): it x object's x, and it x that."""
    first = np.cross(up, [1.0, 0, 0]) if abs(up[0]) < 0.9 else np.cross(up, [0, 1.0, 0])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(up, first)])


def support_axes_of(
    cell_m: NDArray,
    normal: NDArray,
    *,
    support: Support,
    contact_m: NDArray,
    direction: NDArray,
    options: Fit,
) -> SupportAxes:
    """Rigid motions about the foot under a contact.

    Parameters
    ----------
    cell_m, normal : (c, 3) arrays
        Object frame [m], unit normals outward.
    support : Support
    contact_m, direction : (3,) arrays
        Middle of the contact [m]; way of the press, of length 1.
    options : Fit

    Returns
    -------
    SupportAxes
        In proportion to the measured force: of a foot of the same relaxing material that is a
        tenth off while it relaxes by a tenth.
    """
    up = support.up
    foot = contact_m - ((contact_m - support.plane_point_m) @ up) * up
    across = rocking_axes(up)
    std = [options.sinking_std_m, *[options.rocking_std_rad] * 2]

    def along(place: NDArray, way: NDArray) -> NDArray:
        turns = [(np.cross(axis, place - foot) * way).sum(axis=-1) for axis in across]
        return np.stack([-way @ up, *turns], axis=-1)

    return SupportAxes(
        along(cell_m, normal), along(contact_m, direction), np.array(std) * float(support.resting)
    )

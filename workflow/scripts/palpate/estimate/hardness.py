"""Shore A hardness that a material's modulus stands for, by two published relations.

Each is a line through what its authors computed: how far the two are apart says how little a
modulus tells of a durometer's reading, and is no scatter of readings.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

# Readings for which the relations are given, and those between which one is found.
LOWEST, HIGHEST = 20.0, 80.0
READINGS = np.linspace(0.0, 99.0, 991)


def gent(reading: ArrayLike) -> NDArray:
    """Young's modulus of a Shore A reading [Pa], of a cut cone taken for a flat punch.

    A. N. Gent, Rubber Chem. Technol. 31, 1958, 896 (doi:10.5254/1.3542351).
    """
    s = np.asarray(reading, dtype=float)
    return 1e6 * 0.0981 * (56 + 7.62336 * s) / (0.137505 * (254 - 2.54 * s))


def qi(reading: ArrayLike) -> NDArray:
    """The same, of finite elements with a neo-Hookean material.

    H. J. Qi, K. Joyce and M. C. Boyce, Rubber Chem. Technol. 76, 2003, 419
    (doi:10.5254/1.3547752).
    """
    return 1e6 * 10 ** (0.0235 * np.asarray(reading, dtype=float) - 0.6403)


RELATIONS = {"Gent": gent, "Qi": qi}


def readings(modulus_pa: float) -> dict[str, float]:
    """Reading that each relation gives of a modulus [Pa], 0 to 99.

    Raises
    ------
    ValueError
        If the modulus is not positive and finite.
    """
    if not (np.isfinite(modulus_pa) and modulus_pa > 0):
        raise ValueError(f"modulus_pa: expected a positive modulus, found {modulus_pa}")
    return {
        name: float(np.interp(np.log(modulus_pa), np.log(relation(READINGS)), READINGS))
        for name, relation in RELATIONS.items()
    }

"""The transform of a vertex (Eq. 4.23)."""

from dataclasses import dataclass

from numpy.typing import NDArray
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class Transforms:
    """Parameters of Eq. 4.23.

    Attributes
    ----------
    shift_m : (n, 3) array
        Translations t_i [m].
    axes : (n, 3) array
        Unit rotation axes r_i.
    angle : (n,) array
        phi_i [rad].
    """

    shift_m: NDArray
    axes: NDArray
    angle: NDArray

    @property
    def displacement_m(self) -> NDArray:
        """R(r_i, phi_i) t_i, shape (n, 3) [m]."""
        return turned(self, self.shift_m)

    def of(self, vertices: NDArray) -> "Transforms":
        """Those of some vertices."""
        return Transforms(*(values[vertices] for values in vars(self).values()))


def turned(transforms: Transforms, vectors: NDArray, *, back: bool = False) -> NDArray:
    """R(r_i, phi_i) v_i, or its inverse."""
    if not transforms.angle.any():
        return vectors
    angle = -transforms.angle if back else transforms.angle
    return Rotation.from_rotvec(transforms.axes * angle[:, None]).apply(vectors)

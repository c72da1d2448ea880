"""Parts of a scene: a mesh of one kind and finish."""

from dataclasses import dataclass

from numpy.typing import NDArray

TABLE, OBJECT, SPHERE, METAL, GRIP, BOARD, PROP = range(7)
PROBE_PARTS = (SPHERE, METAL, GRIP, BOARD)


@dataclass(frozen=True)
class Finish:
    """How a plain surface looks.

    Attributes
    ----------
    colour : tuple of float
        Linear reflectance in red, green and blue.
    gloss : float
        Strength of the specular highlight.
    shininess : float
        Exponent of the highlight: the larger, the sharper.
    """

    colour: tuple[float, float, float]
    gloss: float
    shininess: float = 40.0


@dataclass(frozen=True)
class Part:
    """A mesh of one kind and finish.

    Attributes
    ----------
    kind : int
        ``TABLE`` ... ``PROP``.
    vertices_m : (n, 3) array
    faces : (m, 3) int array
    finish : Finish
    """

    kind: int
    vertices_m: NDArray
    faces: NDArray
    finish: Finish

"""Record of a press and what is held after it, with its stated errors."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.hertz.range import HertzRange

# A probe that has risen by this part of the deepest depth, or by so many deviations of the depth's
# own error, is no longer held.
RISEN = 0.1
RISEN_DEVIATIONS = 4.0
# Of the forces at rest, to know their scatter, and of those in contact.
FEWEST_AT_REST, FEWEST_IN_CONTACT = 3, 4


@dataclass(frozen=True)
class Record:
    """Samples of a press with what is held after it, and their stated errors.

    Attributes
    ----------
    time_s, depth_m, force_n : (n,) arrays
        Times [s], depths below the undeformed surface [m] and forces along the press [N].
    deepest : int
        Sample with which the loading ends.
    frame_std_m : float
        Standard deviation of each depth's own error [m].
    contact_std_m : float
        Of the error that all depths share [m].
    force_std_n : float
        Of each force's own error, and of the error that all forces share [N].
    """

    time_s: NDArray
    depth_m: NDArray
    force_n: NDArray
    deepest: int
    frame_std_m: float
    contact_std_m: float
    force_std_n: float


def hold_end(depth_m: NDArray, deepest: int, *, frame_std_m: float) -> int:
    """Number of samples up to the end of the hold.

    Parameters
    ----------
    depth_m : (n,) array
        Depth below the undeformed surface [m].
    deepest : int
        Sample with which the loading ends.
    frame_std_m : float
        Standard deviation of each depth's own error [m].
    """
    reached = float(depth_m[: deepest + 1].max())
    risen = depth_m[deepest:] < reached - max(RISEN * reached, RISEN_DEVIATIONS * frame_std_m)
    return deepest + (int(np.argmax(risen)) if risen.any() else len(risen))


def forces_along(
    depth_m: NDArray, forces_n: NDArray, chosen: HertzRange, *, frame_std_m: float
) -> NDArray:
    """Forces along the press, whose direction is that of the mean force of the hold, (n,) [N].

    A magnitude has a positive mean where there is noise alone, and takes what goes across for
    stiffness. Arguments are those of `held_record`.
    """
    end = hold_end(depth_m, chosen.stop, frame_std_m=frame_std_m)
    held = forces_n[chosen.stop : end].mean(axis=0)
    return forces_n @ (held / np.linalg.norm(held))


def held_record(
    time_s: NDArray,
    depth_m: NDArray,
    forces_n: NDArray,
    chosen: HertzRange,
    *,
    frame_std_m: float,
    contact_std_m: float,
) -> Record | None:
    """Samples from the approach to the end of the hold, with the force along the press.

    The force's scatter is that of its three components before contact, about their means.

    Parameters
    ----------
    time_s, depth_m : (n,) arrays
        Times [s] and depths below the undeformed surface [m].
    forces_n : (n, 3) array
        Force [N].
    chosen : HertzRange
    frame_std_m, contact_std_m : float
        Standard deviations of each depth's own error and of the one they share [m].

    Returns
    -------
    Record or None
        None if there are fewer than three samples at rest or four in contact.
    """
    end = hold_end(depth_m, chosen.stop, frame_std_m=frame_std_m)
    along = forces_along(depth_m, forces_n, chosen, frame_std_m=frame_std_m)
    rest = forces_n[: max(chosen.start - 1, 0)]
    used = depth_m[chosen.start : end]
    if len(rest) < FEWEST_AT_REST or (used > 0).sum() < FEWEST_IN_CONTACT:
        return None
    return Record(
        time_s=time_s[:end],
        depth_m=depth_m[:end],
        force_n=along[:end],
        deepest=chosen.stop,
        frame_std_m=float(frame_std_m),
        contact_std_m=float(contact_std_m),
        force_std_n=float(np.sqrt(rest.var(axis=0, ddof=1).mean())),
    )

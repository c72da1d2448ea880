"""Force of a relaxing material at constant Poisson's ratio, forward and back.

Where the elastic force would be F_e it is F(t) = int G(t - s) dF_e(s), with the Prony series
G(t) = 1 - sum g_i (1 - exp(-t/tau_i)) (E. H. Lee and J. R. M. Radok, J. Appl. Mech. 27, 1960,
438, for contacts that grow). With h_i = int exp(-(t - s)/tau_i) dF_e(s) that is
F = (1 - sum g_i) F_e + sum g_i h_i, and an elastic force that is linear between samples takes
h_i from one to the next exactly: h_i <- a_i h_i + b_i dF_e, where a_i = exp(-dt/tau_i) and
b_i = (1 - a_i) tau_i/dt.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solve_banded


def relaxed_force(
    time_s: NDArray, elastic_force_n: NDArray, *, fractions: ArrayLike, times_s: ArrayLike
) -> NDArray:
    """Force of a relaxing material, exact for an elastic force linear between samples.

    Parameters
    ----------
    time_s : (n,) array
        Times of the samples, increasing [s]; a force at the first is applied at that moment.
    elastic_force_n : (n,) or (n, m) array
        Force without relaxation, one column for each history [N].
    fractions, times_s : (p,) arrays
        Share g_i of the instantaneous modulus that each term loses and its time tau_i [s].

    Returns
    -------
    array
        Force, of elastic_force_n's shape [N].

    Raises
    ------
    ValueError
        If times do not increase, shapes differ, a value is not finite, a relaxation time is not
        positive, or the fractions leave nothing.
    """
    time, force, g, tau = _checked(time_s, elastic_force_n, "elastic_force_n", fractions, times_s)
    memory = _memory(time, force, tau)
    return (1 - g.sum()) * force + np.einsum("p,np...->n...", g, memory)


def elastic_force(
    time_s: NDArray, force_n: NDArray, *, fractions: ArrayLike, times_s: ArrayLike
) -> NDArray:
    """Force that the indentation would have without relaxation, the inverse of `relaxed_force`.

    Of the relaxing material's force, (n,) or (n, m) [N], of whose shape it is; other arguments and
    errors are those of `relaxed_force`.
    """
    return _elastic(*_checked(time_s, force_n, "force_n", fractions, times_s))[0]


def elastic_force_derivatives(
    time_s: NDArray, force_n: NDArray, *, fractions: ArrayLike, times_s: ArrayLike
) -> NDArray:
    """Derivatives of `elastic_force` by the fractions, (n, p) [N].

    What a term has taken, F_e - h_i, is the force whose elastic one is the derivative by g_i.
    Arguments and errors are those of `relaxed_force`, of one force (n,).
    """
    time, force, *relaxing = _checked(time_s, force_n, "force_n", fractions, times_s)
    if force.ndim != 1:
        raise ValueError(f"force_n: expected shape (n,), found {force.shape}")
    elastic, memory = _elastic(time, force, *relaxing)
    return _elastic(time, elastic[:, None] - memory, *relaxing)[0]


def relaxed_share(after_s: ArrayLike, *, fractions: ArrayLike, times_s: ArrayLike) -> NDArray:
    """Share of the modulus that is lost a time after a step, sum g_i (1 - exp(-t/tau_i)).

    At times (...) since the step [s], of that shape; fractions and times (p,) as in
    `relaxed_force`.
    """
    decay = -np.expm1(-np.divide.outer(np.asarray(after_s, float), np.asarray(times_s, float)))
    return decay @ np.asarray(fractions, float)


def _elastic(time: NDArray, force: NDArray, g: NDArray, tau: NDArray) -> tuple[NDArray, NDArray]:
    """F_e (n, ...) and h_i (n, p, ...), at each sample the unknowns of a banded linear system."""
    keep, add = _steps(time, tau)
    count, width = len(tau), len(tau) + 1
    term, below = np.arange(1, width), count + width
    # A row for F = (1 - sum g_i) F_e + sum g_i h_i, and one for a step of each h_i, at first F_e.
    bands = np.zeros((below + width, len(time), width))
    bands[count], bands[count, :, 0] = 1, 1 - g.sum()
    bands[count - term, :, term] = g[:, None]
    bands[count + term, :, 0] = -np.vstack([np.ones(count), add]).T
    bands[below, :-1, 1:] = -keep
    bands[below + term, :-1, 0] = add.T
    right = np.zeros((len(time), width, *force.shape[1:]))
    right[:, 0] = force
    size = len(time) * width
    found = solve_banded((below, count), bands.reshape(-1, size), right.reshape(size, -1))
    found = found.reshape(right.shape)
    return found[:, 0], found[:, 1:]


def _memory(time: NDArray, elastic: NDArray, tau: NDArray) -> NDArray:
    """h_i at each sample, (n, p, ...)."""
    keep, add = _steps(time, tau)
    memory = np.empty((len(time), len(tau), *elastic.shape[1:]))
    memory[0] = elastic[0]
    rise = np.diff(elastic, axis=0)
    for n, (a, b) in enumerate(zip(keep, add, strict=True)):
        memory[n + 1] = (a * memory[n].T).T + np.multiply.outer(b, rise[n])
    return memory


def _steps(time: NDArray, tau: NDArray) -> tuple[NDArray, NDArray]:
    """a_i and b_i of each interval, (n - 1, p) each."""
    x = np.divide.outer(np.diff(time), tau)
    return np.exp(-x), -np.expm1(-x) / x


def _checked(
    time_s: NDArray, force_n: NDArray, name: str, fractions: ArrayLike, times_s: ArrayLike
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    time, force, g, tau = (np.asarray(x, float) for x in (time_s, force_n, fractions, times_s))
    if time.ndim != 1 or not len(time) or not np.all(np.diff(time) > 0):
        raise ValueError("time_s: expected increasing times of shape (n,), found others")
    if force.ndim not in (1, 2) or len(force) != len(time):
        raise ValueError(f"{name}: expected one row for each of {len(time)}, found {force.shape}")
    if not np.isfinite(force).all():
        raise ValueError(f"{name}: expected finite forces, found others")
    if tau.ndim != 1 or not np.all(tau > 0):
        raise ValueError("times_s: expected positive times of shape (p,), found others")
    if g.shape != tau.shape:
        raise ValueError(f"fractions: expected one for each of {len(tau)} times, found {g.shape}")
    if not g.sum() < 1:
        raise ValueError(f"fractions: expected a sum below 1, found {g.sum():g}")
    return time, force, g, tau

"""What a probe gives way by as stiffness.json holds it, and what is said of it."""

from math import floor, isfinite, log10

from palpate.vision.bending import Bending

# Deviation up to which all is told: at 5 N it puts the depth 0.02 mm off.
TOLD_M_N = 0.02e-3 / 5
# What needs not be told: 0.05 mm at 5 N.
STIFF_N_M = 1e5


def bending_fields(found: Bending, probe: str | None) -> dict:
    """What stiffness.json says, of a probe by its name where that is known."""
    gap = found.gap_m if isfinite(found.gap_m[0]) else None
    return {
        "probe": probe,
        "stiffness_n_m": found.stiffness_n_m if found.told else None,
        "stiffness_std_n_m": found.std_n_m if found.told else None,
        "stiffer_than_n_m": found.least_n_m if isfinite(found.least_n_m) else None,
        "compliance_m_n": found.compliance_m_n,
        "compliance_std_m_n": found.compliance_std_m_n,
        "samples": found.samples,
        "force_n": found.force_n,
        "rms_m": found.rms_m,
        "bow_m": found.bow_m,
        "gap_m": gap,
        "verdict": verdict(found),
    }


def verdict(found: Bending) -> str:
    """Whether the stiffness is told, and what to do."""
    if found.told:
        more = "" if found.compliance_std_m_n <= TOLD_M_N else ": press harder, or more often"
        return f"stiffness: told, to {digits(found.std_n_m)} N/m{more}"
    stiffer = f"stiffer than {digits(found.least_n_m)} N/m (95 %)"
    enough = "leave it out of the probe's file"
    if found.least_n_m < STIFF_N_M:
        enough += f"; to tell whether it is above {STIFF_N_M:g}, press harder or more often"
    return f"stiffness: not told, {stiffer}: {enough}"


def digits(value: float, count: int = 2) -> str:
    """A number to so many digits, without a power of ten."""
    if not isfinite(value) or value <= 0:
        return f"{value:g}"
    return f"{round(value, count - 1 - floor(log10(value))):.10g}"

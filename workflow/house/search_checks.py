"""Whether the search for the moduli can start where the configuration says."""

from collections.abc import Mapping


def impossible_search(options: Mapping, source: str) -> list[str]:
    """Find bounds out of order and starts outside of them.

    Parameters
    ----------
    options : mapping
        ``minimise`` block of the configuration.
    source : str
        File named in messages.
    """
    problems = []
    for name in ("youngs_modulus_bounds_pa", "poisson_ratio_bounds"):
        low, high = options[name]
        if low >= high:
            problems.append(
                f"{source}: minimise.{name}: expected low below high, found {low:g}, {high:g}"
            )
    low, high = options["poisson_ratio_bounds"]
    for name in ("start_poisson_ratios", "profile_poisson_ratios"):
        outside = [nu for nu in options[name] if not low <= nu <= high]
        if outside and low < high:
            expected = f"within poisson_ratio_bounds, {low:g} to {high:g}"
            problems.append(f"{source}: minimise.{name}: expected {expected}, found {outside[0]:g}")
    ratios = options["profile_poisson_ratios"]
    if sorted(set(ratios)) != list(ratios):
        problems.append(f"{source}: minimise.profile_poisson_ratios: expected increasing numbers")
    return problems

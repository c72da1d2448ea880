"""Whether the search for the moduli can start, and for objects that there are."""

from collections.abc import Collection, Mapping

from palpate.solid.options import greatest_ratio


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


def impossible_table(options: Mapping, source: str) -> list[str]:
    """Find options of the direct estimate whose indentation table can't be made, or doesn't reach.

    Parameters
    ----------
    options : mapping
        ``direct`` block of config.yaml.
    source : str
        File named in messages.
    """
    problems, place = [], f"{source}: direct"
    ratios = options["model"]["poisson_ratios"]
    if sorted(set(ratios)) != list(ratios):
        problems.append(f"{place}.model.poisson_ratios: expected increasing numbers")
        return problems
    low, high = options["fit"]["poisson_ratio_bounds"]
    greatest = greatest_ratio(ratios)
    if not ratios[0] <= low < high <= greatest:
        expected = f"low and high within the table's {ratios[0]:g} to {greatest:g}"
        problems.append(
            f"{place}.fit.poisson_ratio_bounds: expected {expected}, found {low:g}, {high:g}"
        )
    return problems


def unknown_step_trackers(config: Mapping, source: str) -> list[str]:
    """Find steps of the error minimisation whose tracker has no options.

    Parameters
    ----------
    config : mapping
        The configuration.
    source : str
        File named in messages.
    """
    known = sorted(config["tracking"]["trackers"])
    return [
        f"{source}: minimise.steps.{name}.tracker: expected one of {', '.join(known)},"
        f" found {step['tracker']}"
        for name, step in config["minimise"]["steps"].items()
        if step.get("tracker", known[0]) not in known
    ]


def unknown_objects(config: Mapping, others: Collection[str], source: str) -> list[str]:
    """Find options of single objects whose object is nowhere: a slip of the pen takes no effect.

    Parameters
    ----------
    config : mapping
        The configuration; objects that ``study.captures`` names are known too, since a run of
        dropped captures keeps their options.
    others : collection of str
        Names of the objects in raw/ and of the lab.
    source : str
        File named in messages.
    """
    known = sorted({*others, *config["study"]["captures"]})
    return [
        f"{source}: {block}.objects: expected one of {', '.join(known)}, found {name}"
        for block in ("tracking", "minimise")
        for name in config[block]["objects"]
        if name not in known
    ]

"""Options of the named trackers of config.yaml."""

from collections.abc import Mapping

from palpate.surface.options import TRACKERS, tracking_options


def options_of(tracking: Mapping, name: str, object_name: str) -> dict:
    """All options of a tracker for one object, as people write them.

    Parameters
    ----------
    tracking : mapping
        ``tracking`` block of config.yaml, without `tracker_problems`.
    name, object_name : str
        The tracker and the object.
    """
    return tracking_options(chosen(tracking, name, object_name)).written()


def chosen(tracking: Mapping, name: str, object_name: str) -> dict:
    """Options that people chose for a tracker and an object."""
    own = dict(tracking["trackers"][name])
    base = own.pop("like", None)
    inherited = chosen(tracking, base, object_name) if base is not None else {}
    return inherited | own | tracking["objects"].get(object_name, {}).get(name, {})


def tracker_problems(tracking: Mapping) -> list[str]:
    """Say in a line each what is wrong with the trackers of a configuration.

    Parameters
    ----------
    tracking : mapping
        ``tracking`` block of config.yaml, each of its values right by itself.
    """
    problems = _unknown_names(tracking) or _endless(tracking)
    if problems:
        return problems
    for name, own in tracking["objects"].items():
        for tracker, options in own.items():
            for key in sorted({"kind", "like"} & set(options)):
                place = f"objects.{name}.{tracker}.{key}"
                problems.append(f"{place}: expected an option of the tracker's kind, found {key}")
    for name in tracking["trackers"]:
        for thing in ("", *tracking["objects"]):
            place = f"trackers.{name}"
            wrong = _wrong_option(chosen(tracking, name, thing))
            if wrong:
                key, words = wrong
                problems.append(f"{place}.{key}{f' for {thing}' if thing else ''}: {words}")
                break
    return problems


def _wrong_option(written: Mapping) -> tuple[str, str] | None:
    """The first option that a tracker's kind doesn't have, or that is of no use."""
    kind = written.get("kind")
    if kind is None:
        return "kind", f"expected one of {', '.join(TRACKERS)}, found none"
    known = set(TRACKERS[kind].model_fields)
    other = [key for key in written if key not in known]
    if other:
        return other[0], f"expected an option of kind {kind}, found another kind's"
    try:
        options = tracking_options(written)
    except ValueError as error:
        place, _, words = str(error).splitlines()[0].partition(": ")
        return place, words
    if kind == "study" and options.w_sm < options.w_sm_stop:
        return "w_sm", f"expected at least w_sm_stop, {options.w_sm_stop:g}, found {options.w_sm:g}"
    return None


def _unknown_names(tracking: Mapping) -> list[str]:
    known = tracking["trackers"]
    named = [("estimate_from", tracking["estimate_from"])]
    named += [("compared", name) for name in tracking["compared"]]
    named += [(f"trackers.{key}.like", one["like"]) for key, one in known.items() if "like" in one]
    named += [(f"objects.{key}", name) for key, one in tracking["objects"].items() for name in one]
    expected = f"one of tracking.trackers ({', '.join(known)})"
    return [
        f"{place}: expected {expected}, found {name}" for place, name in named if name not in known
    ]


def _endless(tracking: Mapping) -> list[str]:
    problems = []
    for first in tracking["trackers"]:
        name, met = first, set()
        while name is not None and name not in met:
            met.add(name)
            name = tracking["trackers"][name].get("like")
        if name is not None:
            place = f"trackers.{first}.like"
            problems.append(f"{place}: expected a chain that ends, found {name} again")
    return problems

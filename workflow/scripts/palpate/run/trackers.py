"""Options of the named trackers of config.yaml."""

from collections.abc import Mapping

SHARED = ("refine_radius_m", "refine_edge_m", "largest_distance_m", "largest_normal_deg")
# What a kind needs; palpate.surface.study_capture and elastic_capture read them.
NEEDED = {
    "study": (
        *SHARED,
        "w_data",
        "w_sm",
        "w_sm_stop",
        "s_sm",
        "neighbourhood",
        "data_term",
        "data_points",
        "rounds",
        "rotations",
        "coarsest_vertices",
        "completion",
        "undeformed_points",
        "indenter_points",
        "copies",
    ),
    "elastic": (
        *SHARED,
        "solid_edge_m",
        "solid_growth",
        "poisson_ratio",
        "huber",
        "misfit_reach_m",
        "points",
    ),
}


def options_of(tracking: Mapping, name: str, object_name: str) -> dict:
    """Options of a tracker for one object.

    Parameters
    ----------
    tracking : mapping
        ``tracking`` block of config.yaml, without `tracker_problems`.
    name, object_name : str
        The tracker and the object.
    """
    own = dict(tracking["trackers"][name])
    base = own.pop("like", None)
    inherited = options_of(tracking, base, object_name) if base is not None else {}
    return inherited | own | tracking["objects"].get(object_name, {}).get(name, {})


def tracker_problems(tracking: Mapping, source: str) -> list[str]:
    """Say in a line each what is wrong with the trackers of a configuration.

    Parameters
    ----------
    tracking : mapping
        ``tracking`` block of config.yaml, as the schema has it.
    source : str
        File named in the lines.
    """
    problems = _unknown_names(tracking, source) or _endless(tracking, source)
    if problems:
        return problems
    for name, own in tracking["objects"].items():
        for tracker, options in own.items():
            for key in sorted({"kind", "like"} & set(options)):
                place = f"{source}: tracking.objects.{name}.{tracker}.{key}"
                problems.append(f"{place}: expected an option of the tracker's kind, found {key}")
    for name in tracking["trackers"]:
        options = options_of(tracking, name, "")
        kind = options.get("kind", "none")
        missing = [key for key in NEEDED.get(kind, ("kind",)) if key not in options]
        if missing:
            place = f"{source}: tracking.trackers.{name}.{missing[0]}"
            problems.append(f"{place}: expected an option that kind {kind} needs, found none")
            continue
        for thing in ("", *tracking["objects"]):
            options = options_of(tracking, name, thing)
            if kind == "study" and options["w_sm"] < options["w_sm_stop"]:
                place = f"{source}: tracking.trackers.{name}.w_sm" + (
                    f" for {thing}" if thing else ""
                )
                expected = f"at least w_sm_stop, {options['w_sm_stop']:g}"
                problems.append(f"{place}: expected {expected}, found {options['w_sm']:g}")
    return problems


def _unknown_names(tracking: Mapping, source: str) -> list[str]:
    known = tracking["trackers"]
    named = [("estimate_from", tracking["estimate_from"])]
    named += [("compared", name) for name in tracking["compared"]]
    named += [(f"trackers.{key}.like", one["like"]) for key, one in known.items() if "like" in one]
    named += [(f"objects.{key}", name) for key, one in tracking["objects"].items() for name in one]
    expected = f"one of tracking.trackers ({', '.join(known)})"
    return [
        f"{source}: tracking.{place}: expected {expected}, found {name}"
        for place, name in named
        if name not in known
    ]


def _endless(tracking: Mapping, source: str) -> list[str]:
    problems = []
    for first in tracking["trackers"]:
        name, met = first, set()
        while name is not None and name not in met:
            met.add(name)
            name = tracking["trackers"][name].get("like")
        if name is not None:
            place = f"{source}: tracking.trackers.{first}.like"
            problems.append(f"{place}: expected a chain that ends, found {name} again")
    return problems

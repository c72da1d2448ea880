"""Options of the study's tracker, and of the named trackers of a configuration."""

from collections.abc import Iterator, Mapping
from typing import Any, Literal

from palpate.config.model import Count, Model, Positive, constant, option
from palpate.surface.options import ElasticTracking


class Registration(Model):
    """Non-rigid registration of a template with clouds (Eq. 4.25, Section 5.2.1).

    The study prints other values: with those the dent stays untracked (docs/how_it_works.md).
    """

    w_data: Positive = constant(1, "weight of the data")
    w_sm: Positive = option(4, "first weight of the smoothness, halved in each iteration")
    w_sm_stop: Positive = option(1, "until it is below this")
    s_sm: float = option(1, "radius of the smoothness, in edges", gt=0, le=20)
    data_term: Literal["point", "plane"] = option(
        "plane",
        "distance along the normal of the data point, which leaves vertices free sideways; point:"
        " Eq. 4.25 as printed, which drags them",
    )
    data_points: Literal["nearest", "mean"] = option(
        "mean",
        "mean height of the captured points as far as the vertex's edges reach; nearest: as"
        " printed, with all of one point's noise",
    )
    rounds: Count = constant(1, "searches for nearest data points for each w_sm", ge=1)
    largest_distance_m: Positive = constant(0.012, "dr of Eq. 4.24")
    largest_normal_deg: float = constant(60, "between normals of a pair", gt=0, le=180)
    coarsest_vertices: Count = option(2000, "of the hierarchy; 1000 as printed", ge=1)


class StudyRefinement(Model):
    """The template that is registered."""

    kind: Literal["study"] = option("study", "registration by smoothness")
    refine_radius_m: Positive = option(0.020, "of the template around the contact")
    refine_edge_m: float | None = option(0.0025, "null: the template as it is", gt=0)


class StudyTracking(Registration, StudyRefinement):
    """The study's tracker (Section 4.3) with its added points (Section 5.2).

    Examples
    --------
    >>> StudyTracking(w_sm=10).data_term
    'plane'
    """

    completion: Literal["none", "fem"] = option("none", "fem: Algorithm 3")
    undeformed_points: bool = option(True, "of unseen parts that stay undeformed (Section 5.2.1)")
    indenter_points: Literal["none", "places"] = option(
        "places", "of the vertices under the sphere; the study adds a hemisphere's points"
    )
    copies: Count = option(
        1, "of the cloud, turned about the support's normal (Section 5.2.2)", ge=1
    )

    def conflicts(self) -> Iterator[tuple]:
        """A smoothness that would begin below its end."""
        if self.w_sm < self.w_sm_stop:
            yield "w_sm", f"at least w_sm_stop, {self.w_sm_stop:g}", f"{self.w_sm:g}"


TRACKERS = {"study": StudyTracking, "elastic": ElasticTracking}


def tracking_options(written: Mapping) -> StudyTracking | ElasticTracking:
    """Options of a tracker, of the kind that they name."""
    return TRACKERS[written["kind"]].read(written)


def job_options(tracking: Mapping, wildcards: Any) -> dict:
    """Options of a job's tracker for its object; see `options_of`."""
    return options_of(tracking, wildcards.tracker, wildcards.object)


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
        tracking_options(written)
    except ValueError as error:
        place, _, words = str(error).splitlines()[0].partition(": ")
        return place, words
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

from house.mirrors import first_images


# Options and files of the direct estimation: of one capture, or of all of an object with one sensor.
def mirrors_of(wildcards):
    """Normals of the mirrors that lead from a point's first image to it."""
    spec = HOUSE.description_of(wildcards.object)
    _, chain = first_images(spec).get(wildcards.point, (None, []))
    return [spec["mirrors"][number] for number in chain]


def image_of(wildcards):
    """Look-up of the first point that a point is a mirror image of, if it is one."""
    images = first_images(HOUSE.description_of(wildcards.object))
    first, _ = images.get(wildcards.point, (wildcards.point, []))
    if first == wildcards.point:
        return []
    return results(f"{wildcards.object}/indentation-{first}.npz")


def of_one(wildcards):
    """The capture itself."""
    return [wildcards.capture]


def of_all(wildcards):
    """Captures of an object with a sensor that are estimated directly, in order."""
    return list(_direct_with().get((wildcards.object, wildcards.sensor), ()))


@cache
def _direct_with():
    """Captures that are estimated directly, by object and sensor."""
    groups = {}
    for capture in HOUSE.direct:
        key = capture.object, capture.sensor
        groups.setdefault(key, []).append(capture.capture)
    return groups


def direct_files(captures):
    """Inputs of a direct estimate, files of one kind in the order of the captures."""

    def each(name):
        def files(wildcards):
            folder = results(f"{wildcards.object}/{wildcards.sensor}")
            return [f"{folder}/{capture}/{name}" for capture in captures(wildcards)]

        return files

    def lookups(wildcards):
        points = [capture.partition("-")[0] for capture in captures(wildcards)]
        return [results(f"{wildcards.object}/indentation-{p}.npz") for p in points]

    return {
        "object": raw("{object}/object.yaml"),
        "template": template_of,
        "alignments": each("alignment.json"),
        "poses": each("probe_pose.csv"),
        "forces": each("force.csv"),
        "clocks": each("clock.json"),
        "motions": each("motion.npz"),
        "lookups": lookups,
    }


def direct_groups():
    """Objects and sensors whose captures are estimated together, as tables name them."""
    found = {(c["object"], c["sensor"]): c for c in HOUSE.described(direct=True)}
    return [
        {name: c[name] for name in ("object", "sensor", "provenance")}
        for _, c in sorted(found.items())
    ]


def joint_estimates():
    """Estimate from all captures of each object with each sensor."""
    return [
        results(f"{g['object']}/{g['sensor']}/direct.json") for g in direct_groups()
    ]


def direct_outputs():
    """Accuracy of all estimates, where the lab made any of what was estimated."""
    if not HOUSE.described(simulated=True, direct=True):
        return []
    names = ["accuracy", "accuracy_summary"]
    return [results(f"tables/{name}.csv") for name in names]

"""Names: of folders, of files that a table or a field names, and of what is asked for."""

# ruff: noqa: E731
import shutil

from spoilt.place import Mutation, Place

ODD = [
    "../08", "..", ".", "/etc", "a b", "-rf", "--help", "08\n", "08\n09", "\n", "08;ls", "$(ls)",
    "`ls`", "08|09", "{object}", "{capture}", "08'", '08"', "é", "０８", "08\u202e", "08\x1b[31m",
    "%s", "*", "08?", "x" * 200, "CON", "08-a", "08-a01", "08_a01", "08.bak", "~", "#", "\\", "08 ",
    "\udc80", "null", "true", "08-a1-a2",
]  # fmt: skip
PATHS = [
    "../../../../secret.png", "/etc/passwd", "/etc/hostname", "", ".", "..", "color", "color/",
    "./color/000003.png", "color/../color/000003.png", "color//000003.png", "COLOR/000003.PNG",
    "color\\000003.png", "color/000003.png ", "color/000003", "~/000003.png", "$HOME/000003.png",
    "file:///etc/passwd", "https://example.org/a.png", "color/\n.png", "x" * 5000, "a/" * 3000,
    "color/000003.png\0", "-", "color/*.png", "/dev/stdin", "/dev/zero", "/proc/self/environ",
    "\udc80.png", "color/\x1b[31m.png",
]  # fmt: skip


def _usable(name: str) -> bool:
    return name not in (".", "..") and "/" not in name and "\0" not in name


def _label(name: str) -> str:
    return ascii(name if len(name) < 40 else f"{name[:8]}... ({len(name)})")


def corpus() -> list[Mutation]:
    """Mutations of names."""
    return _folders() + _paths() + _fields() + _asked() + _linked()


def _folders() -> list[Mutation]:
    found = []
    for name in filter(_usable, ODD):
        label = _label(name)

        def capture(place: Place, name=name) -> None:
            place.capture.rename(place.sensor / name)

        def more(place: Place, name=name) -> None:
            (place.sensor / name).mkdir()

        def sensor(place: Place, name=name) -> None:
            place.sensor.rename(place.object / name)

        def thing(place: Place, name=name) -> None:
            place.yaml(place.object / "object.yaml", lambda s: s.update(object=name))
            place.object.rename(place.object.parent / name)

        def file(place: Place, name=name) -> None:
            shutil.copy(place.folder / "sensors/kinect.yaml", place.folder / f"sensors/{name}.yaml")

        found += [
            Mutation("name", f"capture {label}", "kinect/", capture),
            Mutation("name", f"empty capture {label}", "kinect/", more),
            Mutation("name", f"sensor {label}", "foam_block/", sensor),
            Mutation("name", f"object {label}", "raw/", thing),
            Mutation("name", f"sensor file {label}", "sensors/", file),
        ]
    for name in ("lab", "tables", "logs", "figures", "benchmarks", "simulation", "pages", "sample",
                 "sensors", "simulations", "LAB", "scans", "background", "summary"):  # fmt: skip

        def reserved(place: Place, name=name) -> None:
            place.yaml(place.object / "object.yaml", lambda s: s.update(object=name))
            place.object.rename(place.object.parent / name)

        found.append(Mutation("name", f"object {name}, which results/ uses", "raw/", reserved))
    return found


def _paths() -> list[Mutation]:
    found = []
    for name in PATHS:

        def row(place: Place, name=name) -> None:
            path = place.capture / "frames.csv"
            rows = path.read_text().splitlines()
            quoted = '"' + name + '"'
            rows[4] = rows[4].replace("color/000003.png", quoted)
            text = "\n".join(rows) + "\n"
            place.write(path, text.encode("utf-8", "surrogateescape"))

        found.append(Mutation("name", f"frames.csv names {_label(name)}", "frames.csv", row))

        def template(place: Place, name=name) -> None:
            change = lambda s: s["template"].update(file=name.encode("utf-8", "replace").decode())
            place.yaml(place.object / "object.yaml", change)

        found.append(Mutation("name", f"template {_label(name)}", "object.yaml", template))
    return found


def _fields() -> list[Mutation]:
    found = []
    for name in ODD[::2]:
        label = _label(name)
        clean = name.encode("utf-8", "replace").decode()

        def probe(place: Place, name=clean) -> None:
            place.yaml(place.object / "object.yaml", lambda s: s.update(probe=name))

        def point(place: Place, name=clean) -> None:
            change = lambda s: s["points"].update({name: s["points"]["01"]})
            place.yaml(place.object / "object.yaml", change)

        def sensor(place: Place, name=clean) -> None:
            place.yaml(place.folder / "sensors/kinect.yaml", lambda s: s.update(sensor=name))

        found += [
            Mutation("name", f"field probe {label}", "object.yaml", probe),
            Mutation("name", f"field points {label}", "object.yaml", point),
            Mutation("name", f"field sensor {label}", "sensors/kinect.yaml", sensor),
        ]
    return found


def _asked() -> list[Mutation]:
    def only(name):
        return lambda place: place.config.update(only=name)

    def path(key, value):
        return lambda place: place.config["paths"].update({key: value})

    cases = {f"only {_label(name)}": only(name) for name in ODD}
    cases |= {f"only {value!r}": only(value) for value in ("", 7, ["foam_block"], True, {})}
    for key in ("raw", "results", "sensors", "probes", "meshes", "lab"):
        for value in ("", "/", "/nowhere", "a\nb", "\0", "x" * 5000, 5, None, ["raw"], "/dev/null"):
            cases[f"paths.{key} {value!r:.30}"] = path(key, value)
    cases |= {
        "results into raw": path("results", "raw"),
        "results into raw/foam_block": path("results", "raw/foam_block"),
        "results into ./raw/": path("results", "./raw/"),
        "results into results/../raw": path("results", "results/../raw"),
        "results into sensors": path("results", "sensors"),
    }
    return [Mutation("name", name, "config/config.yaml", change, option=True)
            for name, change in cases.items()]  # fmt: skip


def _linked() -> list[Mutation]:
    def capture(target):
        def spoil(place: Place) -> None:
            shutil.rmtree(place.capture)
            place.capture.symlink_to(target)

        return spoil

    def color(place: Place) -> None:
        (place.capture / "color").rename(place.folder / "color")
        (place.capture / "color").symlink_to(place.folder / "color")

    def inside(place: Place) -> None:
        (place.capture / "color").rename(place.capture / "pictures")
        (place.capture / "color").symlink_to("pictures")

    def elsewhere(place: Place) -> None:
        place.capture.rename(place.folder / "08")
        place.capture.symlink_to(place.folder / "08")

    def thing(place: Place) -> None:
        (place.object.parent / "again").symlink_to(place.object)

    cases = {
        "capture linked to /etc": capture("/etc"),
        "capture linked to itself": capture("08"),
        "capture linked to its parent": capture(".."),
        "capture linked to nothing": capture("nowhere"),
        "capture linked to the background": capture("background"),
        "color/ linked out of the capture": color,
        "color/ linked inside the capture": inside,
        "capture stands elsewhere": elsewhere,
        "object linked under another name": thing,
    }
    return [Mutation("name", name, "kinect/08", change) for name, change in cases.items()]

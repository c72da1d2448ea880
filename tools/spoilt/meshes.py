"""Templates that are no closed surfaces, or no meshes at all."""

# ruff: noqa: E731
import numpy as np
import trimesh

from spoilt.place import Mutation, Place


def _bytes(change):
    def spoil(place: Place) -> None:
        path = place.object / "template.ply"
        place.write(path, change(path.read_bytes()))

    return spoil


def _mesh(change, **options):
    def spoil(place: Place) -> None:
        mesh = trimesh.load(place.object / "template.ply", process=False)
        mesh = change(mesh) or mesh
        content = mesh.export(file_type="ply", **options)
        place.write(place.object / "template.ply", content)

    return spoil


def _count(element: bytes, count: int):
    def change(content: bytes) -> bytes:
        rows = content.split(b"\n")
        prefix = b"element " + element
        rows = [prefix + b" %d" % count if row.startswith(prefix) else row for row in rows]
        return b"\n".join(rows)

    return change


def _vertex(index: int, value):
    def change(mesh) -> None:
        vertices = mesh.vertices.copy()
        vertices[index] = value
        mesh.vertices = vertices

    return change


def _faces(change):
    def apply(mesh):
        return trimesh.Trimesh(mesh.vertices, change(mesh.faces.copy()), process=False)

    return apply


def _scaled_face(mesh):
    vertices = mesh.vertices.copy()
    vertices[7] = 2 * mesh.center_mass - vertices[7] * 1.4
    mesh.vertices = vertices


def _as(suffix: str, *, name: str = ""):
    def spoil(place: Place) -> None:
        mesh = trimesh.load(place.object / "template.ply", process=False)
        content = mesh.export(file_type=suffix)
        file = name or f"template.{suffix}"
        place.write(place.object / file, content)
        place.yaml(place.object / "object.yaml", lambda s: s["template"].update(file=file))

    return spoil


def _named(name: str):
    def spoil(place: Place) -> None:
        place.yaml(place.object / "object.yaml", lambda s: s["template"].update(file=name))

    return spoil


def _file(name: str, content: bytes):
    def spoil(place: Place) -> None:
        place.write(place.object / name, content)
        _named(name)(place)

    return spoil


HEAD = b"ply\nformat ascii 1.0\n"
OBJ = b"mtllib ../../../../etc/passwd\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def corpus() -> list[Mutation]:
    """Mutations of template.ply."""
    two = lambda m: trimesh.util.concatenate([m, m.copy().apply_translation([1, 0, 0])])
    shell = lambda m: trimesh.util.concatenate([m, m.copy().apply_scale(0.5)])
    cases = {f"cut to {part:.0%}": _bytes(lambda c, p=part: c[: int(len(c) * p)])
             for part in (0.0, 0.001, 0.01, 0.2, 0.6, 0.99)}  # fmt: skip
    counts = (0, 1, 3, 10**6, 2**31 - 1, 2**31, 10**12, 2**63 - 1, 2**64, -1)
    for element in (b"vertex", b"face"):
        for count in counts:
            cases[f"{count} {element.decode()} promised"] = _bytes(_count(element, count))
    for value in (np.nan, np.inf, -np.inf, 1e30, 1e38):
        cases[f"a vertex at {value:g}"] = _mesh(_vertex(5, value))
    cases |= {
        "all vertices at NaN": _mesh(_vertex(slice(None), np.nan)),
        "all vertices in one place": _mesh(_vertex(slice(None), 0.1)),
        "flat": _mesh(lambda m: _vertex(slice(None), m.vertices * [1, 1, 0])(m)),
        "a vertex pulled 20 mm out": _mesh(lambda m: _vertex(5, m.vertices[5] * 1.1)(m)),
        "cutting itself": _mesh(_scaled_face),
        "a hole": _mesh(_faces(lambda f: f[1:])),
        "ten holes": _mesh(_faces(lambda f: f[::10])),
        "no faces": _mesh(_faces(lambda f: f[:0])),
        "a face doubled": _mesh(_faces(lambda f: np.vstack([f, f[:1]]))),
        "a face to nowhere": _mesh(_faces(lambda f: np.vstack([f, [[0, 1, 10**6]]]))),
        "a face of a negative number": _mesh(_faces(lambda f: np.vstack([f, [[0, 1, -1]]]))),
        "half the faces turned": _mesh(_faces(lambda f: np.vstack([f[::2, ::-1], f[1::2]]))),
        "inside out": _mesh(_faces(lambda f: f[:, ::-1])),
        "two pieces": _mesh(two),
        "a shell in a shell": _mesh(shell),
        "ASCII": _mesh(lambda m: None, encoding="ascii"),
        "vertices in another order": _mesh(_permuted),
        "garbage after the header": _bytes(lambda c: c[:300] + bytes(range(256)) * 40),
        "header alone": _bytes(lambda c: c[: c.index(b"end_header") + 11]),
        "a header without end": _bytes(lambda c: c[: c.index(b"end_header")]),
        "a header of 8 MB": _bytes(lambda c: c.replace(b"\n", b"\ncomment " + b"x" * 8_000_000, 1)),
        "big-endian said": _bytes(lambda c: c.replace(b"binary_little", b"binary_big")),
        "ASCII said": _bytes(lambda c: c.replace(b"binary_little_endian", b"ascii")),
        "an unknown format": _bytes(lambda c: c.replace(b"binary_little_endian", b"morse")),
        "unknown types": _bytes(lambda c: c.replace(b"property float", b"property quark")),
        "doubles said": _bytes(lambda c: c.replace(b"property float x", b"property double x")),
        "x lost": _bytes(lambda c: c.replace(b"property float x", b"property float q")),
        "ASCII letters": _bytes(lambda c: HEAD + b"element vertex 3\nproperty float x\n"
                                b"end_header\na\nb\nc\n"),
        "STL": _as("stl"), "OBJ": _as("obj"), "OFF": _as("off"), "GLB": _as("glb"),
        "STL under the name of a PLY": _as("stl", name="template2.ply"),
        "PLY under the name of an STL": _as("ply", name="template.stl"),
        "an OBJ that names /etc/passwd": _file("a.obj", OBJ),
        "object.yaml itself": _named("object.yaml"),
        "a text file": _file("a.txt", b"hello\n"),
        "no ending": _file("surface", b"ply\n"),
        "a pickle": _file("a.pkl", b"\x80\x04\x95."),
        "a ZIP": _file("a.zip", b"PK\x03\x04" + bytes(30)),
        "glTF that names a file": _file("a.gltf", b'{"buffers":[{"uri":"../../../etc/passwd"}]}'),
        "a STEP file": _file("a.step", b"ISO-10303-21;\n"),
        "a short STL": _file("a.stl", bytes(80) + b"\xff\xff\xff\xff"),
        "an ASCII STL of one triangle": _file("b.stl", b"solid a\nfacet normal 0 0 1\n"),
        "an OFF of 10^12": _file("a.off", b"OFF\n1000000000000 3 0\n0 0 0\n"),
        "an OFF of words": _file("b.off", b"OFF\nmany few none\n"),
    }  # fmt: skip
    told = {
        "a vertex pulled 20 mm out": "a template is what people say the object looks like",
    }
    return [
        Mutation("template", name, "template.ply", change, told=told.get(name, ""))
        for name, change in cases.items()
    ]


def _permuted(mesh):
    order = np.random.default_rng(4).permutation(len(mesh.vertices))
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return trimesh.Trimesh(mesh.vertices[order], place[mesh.faces], process=False)

"""Entries of results that were damaged after they were made, and of kept meshes."""

import io
import zipfile

import meshio
import numpy as np

from corrupted import edits as to
from corrupted.captures import TEMPLATE
from corrupted.chain import HERE, KEPT, OUT
from corrupted.places import BLOCK
from corrupted.specifications import OF_OBJECT


def _npy(shape, kind="<f8", data=b""):
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}"
    head = text.ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head.encode() + data


def _members(member):
    """An NPZ whose members hold something else."""

    def apply(old):
        made = io.BytesIO()
        with zipfile.ZipFile(io.BytesIO(old)) as read, zipfile.ZipFile(made, "w") as new:
            for name in read.namelist():
                new.writestr(name, member)
        return made.getvalue()

    return to.content(apply)


def _pickle():
    made = io.BytesIO()
    np.save(made, np.array([{"a": print}], dtype=object), allow_pickle=True)
    return made.getvalue()


def _each(change):
    """Each array of an NPZ changed."""
    return to.arrays(lambda a: {name: change(array) for name, array in a.items()})


def _first(name, change):
    """An array of the first cloud."""
    return to.arrays(lambda a: a | {f"000000/{name}": change(a[f"000000/{name}"].copy())})


def _kept(change):
    """A kept mesh's nodes [m]."""

    def apply(path):
        mesh = meshio.read(path)
        path.unlink()
        meshio.write(path, meshio.Mesh(change(mesh.points), [mesh.cells[0]]))

    return apply


def _tangled(nodes):
    inner = np.abs(nodes - nodes.mean(axis=0)).sum(axis=1).argmin()
    return nodes + (np.arange(len(nodes))[:, None] == inner) * [0.1, 0, 0]


def _behind(points):
    return points + (np.arange(len(points))[:, None] % 3 == 0) * [0, 0, 0.3]


WHOLE = {"cut to half": to.cut(0.5), "zero bytes": to.holds(b"")}
ARCHIVE = WHOLE | {
    "a bit flipped": to.content(to.flipped),
    "pickles inside": _members(_pickle()),
    "shapes of 10^12": _members(_npy("(1000000000000,)")),
    "headers that call": _members(_npy("__import__('os').system('touch escaped')")),
    "no first member": to.arrays(lambda a: {name: a[name] for name in sorted(a)[1:]}),
    "no members": to.arrays(lambda a: {}),
    "half as many": _each(lambda a: a[: len(a) // 2] if a.ndim else a),
}
FEW = {name: ARCHIVE[name] for name in ("cut to half", "a bit flipped", "half as many")}
NANS = {"NaN": _each(lambda a: a * np.nan if a.dtype.kind == "f" else a)}
CLOUD = ARCHIVE | NANS | {
    "flat points": _first("points_m", lambda a: a[:, :2]),
    "seven points": _each(lambda a: a[:7] if a.ndim > 1 else a * 0 + 7),
    "beside the object": _first("points_m", lambda a: a + [0.3, 0, 0]),
    "a third behind it": _first("points_m", _behind),
}  # fmt: skip
JSON = WHOLE | {
    "nested 100000 deep": to.holds(b"[" * 100_000),
}
RIGID = "camera_from_object"
# A damaged file, and the stages that read it.
ENTRIES = {
    f"{HERE}/background.npz mask": FEW | NANS,
    f"{OUT}/mask.npz clouds": FEW
    | {"no foreground": _each(lambda a: a * 0 if a.ndim > 1 else a)},
    f"{OUT}/rest_cloud.npz align": CLOUD,
    f"{HERE}/support_plane.json align": JSON | {
        "no normal": to.lost("normal"),
        "a normal of two": to.put("normal", [0, -1]),
        "a normal of zeros": to.put("normal", [0, 0, 0]),
        "a normal of NaN": to.put("normal", [0, 0, float("nan")]),
        "20 mm off": to.put("offset_m", lambda offset: offset + 0.02),
    },
    f"{OUT}/alignment.json hertz": JSON | {
        f"no {RIGID}": to.lost(RIGID),
        f"{RIGID} of two": to.put(RIGID, [[1, 0], [0, 1]]),
        f"{RIGID} x 2": to.times(RIGID, 2),
        "contact_point_m in words": to.put("contact_point_m", "top"),
        "no residual": to.lost("residual"),
    },
    f"{OUT}/probe_pose.csv align": WHOLE | {
        "no tip_y_m": to.table(lambda t: t.drop(columns="tip_y_m")),
        "a tip of NaN": to.cell("tip_y_m", 1, "nan"),
        "a tip in words": to.cell("tip_x_m", 1, "abc"),
        "tips 30 mm nearer": to.table(lambda t: t.assign(tip_z_m=t["tip_z_m"] - 0.03)),
        "tips 30 mm aside": to.table(lambda t: t.assign(tip_x_m=t["tip_x_m"] + 0.03)),
    },
    f"{OUT}/force.csv hertz": WHOLE | {
        "no fy_n": to.table(lambda t: t.drop(columns="fy_n")),
        "no force": to.table(lambda t: t.assign(fx_n=0.0, fy_n=0.0, fz_n=0.0)),
    },
    f"{KEPT} solid_mesh": WHOLE | {
        "no mesh": to.holds(b"<VTKFile type='UnstructuredGrid'>"),
        "of a larger object": _kept(lambda nodes: 1.2 * nodes),
        "tangled": _kept(_tangled),
    },
    f"{BLOCK}/template.ply align": {name: TEMPLATE[name] for name in (
        "a hole", "two pieces", "a vertex at NaN", "upside down", "20 mm higher")},
    f"{BLOCK}/template.ply solid_mesh": {name: TEMPLATE[name] for name in (
        "a hole", "two pieces", "cutting itself", "a shell in a shell")},
    f"{BLOCK}/object.yaml solid_mesh": {name: OF_OBJECT[name] for name in (
        "plane_normal of zeros", "plane_point_m 10 mm low")},
}  # fmt: skip

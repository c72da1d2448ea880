"""What an entry changes: functions that give a change of a file in the current folder."""

import io
import json
import os
import shutil

import cv2
import numpy as np
import pandas as pd
import trimesh
import yaml


def write(path, content):
    """Replace a file; its other hard links keep what they hold."""
    path.unlink(missing_ok=True)
    path.write_bytes(content.encode() if isinstance(content, str) else content)


def content(change):
    """Bytes of a file."""
    return lambda path: write(path, change(path.read_bytes()))


def holds(new):
    """Bytes that have nothing to do with the file's."""
    return lambda path: write(path, new)


def cut(part):
    """The beginning alone."""
    return content(lambda old: old[: int(len(old) * part)])


def flipped(old):
    """One bit in the middle flipped."""
    at = len(old) // 2
    return old[:at] + bytes([old[at] ^ 0x10]) + old[at + 1 :]


def lines(change):
    """A table's header and rows, as text."""

    def apply(old):
        head, *rows = old.decode().splitlines()
        return "\n".join(change(head, rows)).encode() + b"\n"

    return content(apply)


def row(index, change):
    """One row's text."""
    return lines(lambda head, rows: [head, *rows[:index], change(rows[index]), *rows[index + 1 :]])


def table(change):
    """A CSV table."""

    def apply(path):
        read = pd.read_csv(path)
        write(path, change(read).to_csv(index=False, lineterminator="\n"))

    return apply


def cell(column, at, value):
    """One cell, a text or a number."""

    def change(read):
        read = read.astype(object)
        read.loc[at, column] = value
        return read

    return table(change)


def scaled(factor, *columns):
    """Columns times a factor."""
    return table(lambda t: t.assign(**{name: t[name] * factor for name in columns}))


def later(shift_s, factor=1.0):
    """Times at another pace, and later."""
    return table(lambda t: t.assign(time_s=t["time_s"] * factor + shift_s))


def fields(change):
    """Content of a YAML or JSON file."""

    def apply(path):
        spec = yaml.safe_load(path.read_text())
        spec = change(spec) or spec
        dump = json.dumps if path.suffix == ".json" else yaml.safe_dump
        write(path, dump(spec))

    return apply


def put(name, value):
    """One field, named with dots, of another value; a function gives it from the old one."""

    def change(spec):
        part, key = _field(spec, name)
        part[key] = value(part[key]) if callable(value) else value

    return fields(change)


def times(name, factor):
    """One field's number or numbers times a factor."""
    return put(name, lambda old: np.multiply(old, factor).tolist())


def lost(name):
    """No such field."""

    def change(spec):
        part, key = _field(spec, name)
        del part[key]

    return fields(change)


def _field(spec, name):
    *groups, key = [int(key) if key.isdigit() and len(key) == 1 else key for key in name.split(".")]
    for group in groups:
        spec = spec[group] if isinstance(spec, list) else spec.setdefault(group, {})
    return spec, key


def pixels(change):
    """Pixels of an image, or of all in a folder."""

    def apply(path):
        for image in sorted(path.glob("*.png")) if path.is_dir() else [path]:
            changed = np.ascontiguousarray(change(cv2.imread(str(image), cv2.IMREAD_UNCHANGED)))
            write(image, cv2.imencode(".png", changed)[1].tobytes())

    return apply


def mesh(change, **options):
    """A surface, of its vertices and triangles."""

    def apply(path):
        old = trimesh.load(path, process=False)
        new = trimesh.Trimesh(*change(old.vertices.copy(), old.faces.copy()), process=False)
        write(path, new.export(file_type=path.suffix[1:], **options))

    return apply


def vertices(change):
    """Vertices of a surface [m]."""
    return mesh(lambda v, f: (change(v), f))


def faces(change):
    """Triangles of a surface."""
    return mesh(lambda v, f: (v, change(f)))


def arrays(change):
    """Arrays of an NPZ file, by name."""

    def apply(path):
        with np.load(path) as data:
            kept = change(dict(data))
        made = io.BytesIO()
        np.savez(made, **kept)
        write(path, made.getvalue())

    return apply


def gone(path):
    """Nothing there."""
    shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()


def linked(target):
    """A link in its place."""
    return both(gone, lambda path: path.symlink_to(target))


def pipe(path):
    """A pipe in its place, at which a reader waits for ever."""
    gone(path)
    os.mkfifo(path)


def named(name):
    """Another name."""
    return lambda path: path.rename(path.parent / name)


def copied(source):
    """What another file holds; relative to this one's folder."""
    return lambda path: write(path, (path.parent / source).read_bytes())


def both(*changes):
    """One change after the other."""
    return lambda path: [change(path) for change in changes]


def beside(name, change):
    """A change of another file, relative to this one's folder."""
    return lambda path: change(path.parent / name)

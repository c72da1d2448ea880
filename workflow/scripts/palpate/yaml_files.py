"""Read YAML that people write, and give messages about it on one line."""

import re
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml

LONGEST_LINE = 720
# Of a line that is too long: how much of its beginning and of its end is kept.
HEAD, TAIL = 400, 300
# What people write by hand stays far below; aliases can make a short file hold billions of values.
LARGEST_BYTES, MOST_VALUES = 1_000_000, 100_000
# OpenCV's first line and its tags, which are none of YAML's, and the last of an echoed ROS message.
NO_YAML = re.compile(r"\A%YAML:1\.0[ \t]*$|!!opencv-[\w-]+|^---\s*\Z", re.MULTILINE)
MERGE = "tag:yaml.org,2002:merge"
# What PyYAML's constructors raise over tagged values that are none: !!float abc, 2020-13-45.
NO_VALUES = (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError)


def one_line(text: str) -> str:
    """Give a message on one line: what a terminal would obey is written out, a long middle cut.

    Printable characters alone, of names and values of files that anybody may have written.
    """
    plain = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
    if len(plain) <= LONGEST_LINE:
        return plain
    return f"{plain[:HEAD]} ... {plain[-TAIL:]}"


def mismatch(field: object, expected: object, found: object) -> ValueError:
    """Error to raise where a field, of a file or a call, is not as expected."""
    return ValueError(f"{field}: expected {expected}, found {found}")


class _UniqueKeys(yaml.SafeLoader):
    """Safe loader that rejects a key given twice."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict:
        seen = set()
        for name, _ in node.value:
            if name.tag == MERGE:
                continue
            key = self.construct_object(name, deep=deep)
            if isinstance(key, Hashable) and key in seen:
                raise yaml.YAMLError(f"key {key} is given twice")
            seen |= {key} if isinstance(key, Hashable) else set()
        return super().construct_mapping(node, deep)


def load_yaml(path: str | Path) -> Any:
    """Read a YAML file of plain values.

    Raises
    ------
    ValueError
        If the file is missing, is no YAML, gives a key twice, or holds more than people write.
    """
    path = Path(path)
    if not is_file(path):
        raise ValueError(one_line(f"{path}: file: expected a file, found none"))
    if path.stat().st_size > LARGEST_BYTES:
        found = f"expected YAML of at most {LARGEST_BYTES} bytes, found {path.stat().st_size}"
        raise ValueError(one_line(f"{path}: file: {found}"))
    try:
        return _plain(NO_YAML.sub("", path.read_text(encoding="utf-8-sig")))
    except (yaml.YAMLError, *NO_VALUES) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        line = f"{path}: file: expected plain YAML, found none ({reason})"
        raise ValueError(one_line(line)) from None


def is_file(path: Path) -> bool:
    """Whether a file stands there; False for names that no file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def _plain(text: str) -> Any:
    loader = _UniqueKeys(text)
    try:
        node = loader.get_single_node()
        if node is None:
            return None
        if _values(node, {}) > MOST_VALUES:
            raise yaml.YAMLError(f"more than {MOST_VALUES} values, or one that holds itself")
        return loader.construct_document(node)
    finally:
        loader.dispose()


def _values(node: yaml.Node, known: dict[int, int]) -> int:
    """Values below a node, those behind aliases as often as they are named."""
    if id(node) not in known:
        known[id(node)] = MOST_VALUES  # of a node that holds itself
        parts = node.value if isinstance(node, yaml.CollectionNode) else ()
        flat = (one for part in parts for one in (part if isinstance(part, tuple) else (part,)))
        known[id(node)] = 1 + sum(_values(one, known) for one in flat)
    return known[id(node)]

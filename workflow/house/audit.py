"""What the environment is made of, from the lock and the installed packages' own words.

``make audit`` runs it. It sees a package that is installed in another version than locked, one that
is not locked, a lock without hashes, files that changed since they were installed, and licences. It
knows nothing of vulnerabilities: those are `pip-audit`'s, which needs its database.
"""

import argparse
import base64
import csv
import hashlib
import re
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib.metadata import Distribution, distributions
from pathlib import Path

REQUIREMENT = re.compile(r"^([A-Za-z0-9][A-Za-z0-9._-]*)(?:\[[^\]]*\])?==([^\s;\\]+)")
HASH = re.compile(r"--hash=sha256:[0-9a-f]{64}\b")
# Made by `python -m venv` itself.
OF_VENV = ("pip", "setuptools")
LONGEST_LICENCE = 60


@dataclass(frozen=True)
class Locked:
    """One package of a lock: its version and how many files it may be."""

    name: str
    version: str
    hashes: int


@dataclass(frozen=True)
class Package:
    """One line of the audit."""

    package: str
    locked: str
    installed: str
    hashes: int
    licence: str
    homepage: str


def read_lock(path: str | Path) -> list[Locked]:
    """Read a lock as ``uv pip compile --generate-hashes`` writes it.

    Raises
    ------
    ValueError
        If a line asks for a package in another way than by version and hashes.
    """
    text = Path(path).read_text(encoding="utf-8").replace("\\\n", " ")
    return [
        _locked(path, line) for line in map(str.strip, text.splitlines()) if line and line[0] != "#"
    ]


def _locked(path: str | Path, line: str) -> Locked:
    found, hashes = REQUIREMENT.match(line), HASH.findall(line)
    if not found or not hashes:
        raise ValueError(f"{path}: package: expected name==version and hashes, found {line[:80]}")
    return Locked(normal(found.group(1)), found.group(2), len(hashes))


def normal(name: str) -> str:
    """A package's name as indices compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def audited(lock: list[Locked]) -> tuple[list[Package], list[str]]:
    """Hold the installed packages to a lock: a line for each package, and what is wrong."""
    installed = {normal(one.metadata["Name"]): one for one in distributions()}
    rows, problems = [], []
    for one in lock:
        there = installed.pop(one.name, None)
        found = there.version if there else ""
        rows.append(
            Package(one.name, one.version, found, one.hashes, _licence(there), _homepage(there))
        )
        if found != one.version:
            expected = f"expected {one.version}, found {found or 'nothing installed'}"
            problems.append(f"{one.name}: version: {expected}")
    problems += [
        f"{name}: lock: expected a locked package, found {there.version} installed beside"
        for name, there in sorted(installed.items())
        if name not in OF_VENV
    ]
    return rows, problems


def changed_files(there: Distribution) -> Iterator[str]:
    """Lines for files of a package that are not as they were installed."""
    for file in there.files or ():
        path = Path(str(file.locate()))
        if file.hash is None or path.suffix == ".pyc":
            continue
        if not path.is_file():
            yield f"{there.metadata['Name']}: {file}: expected a file, found nothing"
            continue
        digest = hashlib.new(file.hash.mode, path.read_bytes()).digest()
        if base64.urlsafe_b64encode(digest).rstrip(b"=").decode() != file.hash.value:
            yield f"{there.metadata['Name']}: {file}: expected the installed file, found another"


def _licence(there: Distribution | None) -> str:
    if there is None:
        return ""
    stated = there.metadata.get("License-Expression") or there.metadata.get("License") or ""
    stated = "" if stated.strip() == "UNKNOWN" else stated
    classes = [
        one.rpartition("::")[2].strip()
        for one in there.metadata.get_all("Classifier") or ()
        if one.startswith("License ::")
    ]
    short = stated.strip().partition("\n")[0]
    return short if 0 < len(short) <= LONGEST_LICENCE else "; ".join(classes) or "not stated"


def _homepage(there: Distribution | None) -> str:
    if there is None:
        return ""
    pages = [one.partition(",")[2].strip() for one in there.metadata.get_all("Project-URL") or ()]
    return there.metadata.get("Home-page") or (pages[0] if pages else "")


def main() -> int:
    """Write the audit's table; the exit status is 1 when anything is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("lock", type=Path)
    parser.add_argument("table", type=Path)
    parser.add_argument("--files", action="store_true", help="hold installed files to their hashes")
    options = parser.parse_args()
    rows, problems = audited(read_lock(options.lock))
    if options.files:
        problems += [line for there in distributions() for line in changed_files(there)]
    options.table.parent.mkdir(parents=True, exist_ok=True)
    with options.table.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, Package.__dataclass_fields__, lineterminator="\n")
        writer.writeheader()
        writer.writerows(asdict(row) for row in rows)
    unstated = sum(row.licence == "not stated" for row in rows)
    summary = f"{len(rows)} packages locked with hashes, {unstated} state no licence"
    print("\n".join([*problems, f"{summary}, {len(problems)} problems"]))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())

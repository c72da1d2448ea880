"""Files of the project where the working directory has none of its own; who said what is wrong."""

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NoReturn

from palpate.yaml_files import load_yaml

# What a person says of a run wins over what the study says.
CONFIGURATION = ("config/thesis.yaml", "config/config.yaml")
# Of a run's paths, those that the project has something at.
SHIPPED = ("sensors", "probes", "meshes")
LAB = "config/lab.yaml"


def sources_of(project: Path) -> list[str]:
    """Files of the configuration: the working directory's own, or else the project's."""
    own = [path for path in CONFIGURATION if Path(path).exists()]
    return own or [str(project / path) for path in CONFIGURATION]


def beside(path: str, project: Path) -> str:
    """A path of the working directory, or the project's own where nothing stands there."""
    own = project / path
    # Names may be longer than any file's.
    return path if os.path.exists(path) or not os.path.exists(own) else str(own)


def placed(paths: Mapping[str, str | None], project: Path) -> dict[str, str | None]:
    """Paths of a run, those of devices as `beside` has them.

    The lab is the working directory's own, or none: it films with the project's sensors.
    """
    found = {name: beside(paths[name], project) for name in SHIPPED if paths[name]}
    own = {} if paths["lab"] != LAB or Path(LAB).exists() else {"lab": None}
    return {**paths, **found, **own}


def who_said(line: str, sources: Sequence[str], told: Mapping) -> str:
    """A line about the configuration, with the source that says most of its field.

    The line begins with the first source, then the field. What a source says holds over those
    before it, and what the command line says (``told``) over all.
    """
    first, _, rest = line.partition(": ")
    if first != sources[0]:
        return line
    parts = rest.partition(":")[0].split(".")
    said = [(source, _content(source)) for source in sources] + [("--config", told)]
    deepest, _, place = max((_known(what, parts), k, place) for k, (place, what) in enumerate(said))
    return f"{place if deepest else first}: {rest}"


def _content(source: str) -> object:
    try:
        return load_yaml(source)
    except ValueError:
        return {}


def _known(content: object, parts: Sequence[str]) -> int:
    """How many parts of a field's place are known."""
    if not parts or not isinstance(content, Mapping) or parts[0] not in content:
        return 0
    return 1 + _known(content[parts[0]], parts[1:])


def refuse(error: ValueError) -> NoReturn:
    """End Snakemake with an error's lines, as jobs end with theirs, and the exit status 1.

    An exception would be shown with its name and with lines of the workflow's code, and with
    ``--quiet all`` not at all.
    """
    sys.stderr.write("".join(f"error: {line}\n" for line in str(error).splitlines()))
    raise SystemExit(1) from None


def require_values(given: Mapping) -> None:
    """Reject what stands after ``--config`` without a value: it would mean that none is wanted."""
    line = "expected a value, found nothing (leave it out for what the configuration says)"
    if empty := [f"--config {name}=: {line}" for name, value in given.items() if value is None]:
        raise ValueError("\n".join(empty))

"""What a run was made with: its options and the versions behind it."""

from collections.abc import Mapping, Sequence

import yaml

from palpate.markdown import rows_of
from palpate.workflow.digest import PIN


def pinned(lock: str, names: Sequence[str]) -> dict[str, str]:
    """Versions of packages in a lock.

    Parameters
    ----------
    lock : str
        Content of environment.lock: ``name==version`` at the head of a line.
    names : sequence of str

    Returns
    -------
    dict
        Version by name.

    Raises
    ------
    ValueError
        If the lock lacks one of them.
    """
    versions = dict(PIN.findall(lock))
    missing = [name for name in names if name not in versions]
    if missing:
        raise ValueError(f"lock: expected a version of {missing[0]}, found none")
    return {name: versions[name] for name in names}


def describe(config: Mapping, versions: Mapping[str, str]) -> str:
    """Configuration and versions as Markdown, the same text for the same run.

    Parameters
    ----------
    config : mapping
        As in force, after all overrides.
    versions : mapping
        Version by name, in the order in which they are to stand.
    """
    options = yaml.safe_dump(plain(config), sort_keys=False, width=96, allow_unicode=True)
    return "\n".join(
        [
            "# Configuration and versions",
            "",
            "## Versions",
            "",
            *rows_of(("package", "version"), versions.items()),
            "",
            "## Configuration",
            "",
            "```yaml",
            options.rstrip(),
            "```",
            "",
        ]
    )


def plain(value: object) -> object:
    """Snakemake's own mappings and lists as those that YAML knows."""
    if isinstance(value, Mapping):
        return {str(key): plain(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(part) for part in value]
    return value

"""The project's configuration, as a run reads it."""

import yaml
from thesis.options import StudyConfig


def written(root, *names):
    """What config.yaml and thesis.yaml say together; other files' names are taken after them."""
    content = {}
    for name in ("config/config.yaml", "config/thesis.yaml", *names):
        content = merged(content, yaml.safe_load((root / name).read_text()))
    return content


def full(root, *names):
    """The same with the defaults of what they leave out."""
    return StudyConfig.read(written(root, *names)).written()


def merged(before, changes):
    """A mapping with changes, block by block."""
    both = [k for k in before.keys() & changes.keys() if isinstance(changes[k], dict)]
    return {**before, **changes} | {key: merged(before[key], changes[key]) for key in both}

"""The documents name what exists: links, library, options, equations of the study."""

import importlib
import re
from contextlib import suppress
from copy import deepcopy
from functools import cache
from pathlib import Path

import pytest
import yaml
from palpate.capture.devices import MODELS
from palpate.config.model import problems
from settings import full
from thesis.options import StudyConfig
from thesis.tracker.options import options_of

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
THEORY = (ROOT / "docs/how_it_works.md").read_text(encoding="utf-8")
ROOMS = {path.stem for path in (ROOT / "workflow/scripts/palpate").glob("[a-z]*")}
WINGS = ("palpate", "virtual_lab", "thesis", "validation")
LINK = re.compile(r"\]\(([^)\s]+)\)")
NUMBER = r"[2-5]\.\d+"
EQUATIONS = re.compile(rf"(?:Eqs?\.|Equations?) ({NUMBER}(?:(?:, | and | to |-){NUMBER})*)")
# What the study numbers in the chapters that are computed.
STUDY = {f"{c}.{k}" for c, last in ((3, 33), (4, 28), (5, 1)) for k in range(1, last + 1)}


def equations(text):
    """Numbers of the study's equations that a text names, ranges filled in."""
    found = set()
    for numbers in EQUATIONS.findall(" ".join(text.split())):
        found |= set(re.findall(NUMBER, numbers))
        for first, last in re.findall(rf"({NUMBER})(?:-| to )({NUMBER})", numbers):
            chapter, start = first.split(".")
            found |= {f"{chapter}.{k}" for k in range(int(start), int(last.split(".")[1]) + 1)}
    return found


def named(text):
    """What stands between single backticks, outside of fenced blocks."""
    prose = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    return sorted(set(re.findall(r"`([^`]+)`", prose)))


def missing(name):
    """What is wrong with a name of docs/how_it_works.md; None where it is right."""
    if name.startswith("make "):
        made = re.search(rf"^{name.split()[1]}:", read("Makefile"), re.MULTILINE)
        return None if made else "no target"
    if name.startswith("results/") or name.endswith((".json", ".csv")):
        places = [*ROOT.glob("workflow/rules/*.smk"), *ROOT.glob("workflow/**/artefacts.yaml")]
        places += [ROOT / "docs/capture_format.md"]  # people's own files
        rules = "".join(map(read, places))
        return None if Path(name).stem in rules else "no rule makes it"
    if "/" in name:
        return None if (ROOT / name).exists() else "no such file"
    path, _, value = name.partition(": ")
    head = path.split(".")[0]
    if head in ROOMS.union(WINGS) and not value and in_library(path):
        return None
    places = {"sensor": "sensors", "probe": "probes"}
    if head in places:
        files = sorted((ROOT / "config" / places[head]).glob("*.yaml"))
        options = [(head, file, path.partition(".")[2]) for file in files]
    else:
        return None if in_configuration(path, value) else "nowhere"
    return None if any(in_options(*option, value) for option in options) else "nowhere"


@cache
def read(path):
    return (ROOT / path).read_text(encoding="utf-8")


def in_library(path):
    """Whether a module of a wing or of a room of the tool, or a thing in it, exists."""
    head, *parts = path.split(".")
    if not parts:
        return False
    found = importlib.import_module(head if head in WINGS else f"palpate.{head}")
    for part in parts:
        if not hasattr(found, part):
            with suppress(ModuleNotFoundError, AttributeError):
                importlib.import_module(f"{found.__name__}.{part}")
        if not hasattr(found, part):
            return False
        found = getattr(found, part)
    return True


def in_configuration(path, value):
    """Whether the configuration has an option, and its model allows the value."""
    content = full(ROOT)
    trackers = content["tracking"]["trackers"]
    trackers |= {name: options_of(content["tracking"], name, "") for name in trackers}
    there = put(content, path, value)
    return there and not problems(StudyConfig, content)


def in_options(kind, file, path, value):
    """Whether a file has an option, and its model allows the value."""
    content = deepcopy(yaml.safe_load(read(file)))
    return put(content, path, value) and not problems(MODELS[f"{kind}s"], content)


def put(content, path, value):
    """Whether a mapping has an option; it takes the value, if there is one."""
    *way, last = path.split(".")
    for key in way:
        content = content.get(key) if isinstance(content, dict) else None
    if not isinstance(content, dict) or last not in content:
        return False
    if value:
        content[last] = yaml.safe_load(value)
    return True


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_somewhere(document):
    links = [link for link in LINK.findall(document.read_text("utf-8")) if "://" not in link]
    lost = [link for link in links if not (document.parent / link.partition("#")[0]).exists()]
    assert not lost


def test_the_theory_names_what_exists():
    names = named(THEORY)
    assert len(names) > 100
    assert not {name: reason for name in names if (reason := missing(name))}


def test_equations_of_the_code_are_explained():
    explained = equations(THEORY)
    for path in sorted((ROOT / "workflow/scripts/palpate").rglob("*.py")):
        unknown = equations(read(path)) - explained
        assert not unknown, path


def test_every_equation_of_the_study_has_its_place():
    assert not STUDY - equations(THEORY)


def test_pictures_are_the_workflows_own():
    # Diagrams, which are drawn by hand, are SVG.
    listed = re.search(r"^PICTURES := (.*)$", read("Makefile"), re.MULTILINE).group(1).split()
    kept = sorted(path.stem for path in (ROOT / "docs/pictures").glob("*.png"))
    pages = [read("README.md"), *(page.read_text() for page in (ROOT / "docs").glob("*.md"))]
    links = [Path(link) for text in pages for link in LINK.findall(text)]
    shown = {link.name for link in links if link.parent.name == "pictures"}
    assert shown == {path.name for path in (ROOT / "docs/pictures").iterdir()}
    assert kept == sorted(listed)
    makers = [*(ROOT / "tools").glob("bench*.py"), ROOT / "Makefile"]
    others = " ".join(path.read_text() for path in makers)
    drawn = [name for name in listed if f"figures/{name}.png" not in others]
    assert drawn and not [name for name in drawn if missing(f"results/figures/{name}.png")]

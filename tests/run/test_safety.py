"""No code of the workflow runs what a capture holds, or talks to the network (ruff's rules)."""

import re
import subprocess
import sys

import numpy as np
import pytest

HARMFUL = {
    "x = eval(text)": "S307",
    "exec(text)": "S102",
    "import os\nos.system(f'rm {name}')": "S605",
    "import subprocess\nsubprocess.run(text, shell=True)": "S602",
    "import pickle": "TID251",
    "from pickle import load": "TID251",
    "import urllib.request": "TID251",
    "import pandas as pd\npd.read_pickle(path)": "TID251",
    "import yaml\nyaml.load(text, Loader=yaml.Loader)": "S506",
    "import yaml\nyaml.unsafe_load(text)": "TID251",
}
HARMLESS = "import re\nimport subprocess\n\nre.compile('a')\nsubprocess.run(['a'], shell=False)\n"


def rules_of(root, code):
    """Rules that ruff finds broken in a text that stood in the library."""
    ruff = [sys.executable, "-m", "ruff", "check", "--output-format", "concise"]
    name = ["--stdin-filename", "workflow/scripts/palpate/a.py", "-"]
    done = subprocess.run([*ruff, *name], input=code, cwd=root, capture_output=True, text=True)
    return set(re.findall(r"\b(S\d+|TID\d+)\b", done.stdout))


@pytest.mark.parametrize(("code", "rule"), HARMFUL.items())
def test_harmful_code_is_refused(root, code, rule):
    assert rule in rules_of(root, code)


def test_harmless_code_passes(root):
    assert rules_of(root, HARMLESS) == set()


def test_arrays_are_never_unpickled(tmp_path):
    """What NumPy does by default, on which all reading of arrays rests."""
    np.save(tmp_path / "a.npy", np.array([object()]), allow_pickle=True)
    with pytest.raises(ValueError, match="allow_pickle"):
        np.load(tmp_path / "a.npy")


def test_rules_are_scripts(root):
    """A rule's shell line would take names of captures into a shell."""
    files = [root / "Snakefile", *root.glob("workflow/Snakefile"), *root.glob("workflow/**/*.smk")]
    assert len(files) > 5
    for path in files:
        assert not re.search(r"^\s+(shell|run):", path.read_text(), re.MULTILINE), path

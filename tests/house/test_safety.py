"""No code of the workflow runs what a capture holds, or talks to the network."""

import pytest
from house.safety import unsafe_code, unsafe_rules, unsafe_workflow


def test_the_workflow_is_safe(root):
    assert unsafe_workflow(root) == []


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("x = eval(text)", "eval: runs a text"),
        ("exec(text)", "exec: runs a text"),
        ("import os\nos.system(f'rm {name}')", ":2: os.system: gives a text to a shell"),
        ("subprocess.run(text, shell=True)", "subprocess.run: gives a text to a shell"),
        ("import pickle", "import pickle: runs what it reads"),
        ("from pickle import load", "import pickle: runs what it reads"),
        ("import urllib.request", "import urllib.request: talks to the network"),
        ("np.load(path)", "np.load: may run a pickle"),
        ("np.load(path, allow_pickle=True)", "np.load: may run a pickle"),
        ("yaml.load(text, Loader=yaml.Loader)", "yaml.load: may make objects of YAML"),
        ("yaml.unsafe_load(text)", "yaml.unsafe_load: makes objects of YAML"),
    ],
)
def test_unsafe_code_is_named(tmp_path, code, words):
    path = tmp_path / "a.py"
    path.write_text(code)
    (line,) = unsafe_code(path)
    assert line.startswith(f"{path}:")
    assert words in line


def test_safe_code_is_passed_over(tmp_path):
    path = tmp_path / "a.py"
    path.write_text(
        "model.eval()\nnp.load(path, allow_pickle=False)\nyaml.safe_load(text)\n"
        "subprocess.run([name], shell=False)\nre.compile(text)\n"
    )
    assert unsafe_code(path) == []


def test_a_rule_with_a_shell_line(tmp_path):
    path = tmp_path / "a.smk"
    path.write_text('rule a:\n    output: "x"\n    shell:\n        "touch {output}"\n')
    assert unsafe_rules(path) == [f"{path}:3: shell: rules are scripts"]

"""What code of the workflow never does: run what a capture holds, or talk to the network.

Captures, sensors' files and results are data. These checks read the code's syntax, so that a loader
that could run its input, or a shell that could run a name, does not come back unseen.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

FORBIDDEN_CALLS = {
    "eval": "runs a text",
    "exec": "runs a text",
    "compile": "makes code of a text",
    "__import__": "imports what a text names",
    "os.system": "gives a text to a shell",
    "os.popen": "gives a text to a shell",
    "subprocess.getoutput": "gives a text to a shell",
    "subprocess.getstatusoutput": "gives a text to a shell",
    "yaml.unsafe_load": "makes objects of YAML",
    "yaml.full_load": "makes objects of YAML",
    "yaml.load_all": "may make objects of YAML",
    "pd.read_pickle": "runs a pickle",
    "pandas.read_pickle": "runs a pickle",
    "pd.eval": "runs a text",
}
FORBIDDEN_MODULES = {
    "pickle": "runs what it reads",
    "cPickle": "runs what it reads",
    "dill": "runs what it reads",
    "joblib": "reads pickles",
    "marshal": "reads code",
    "shelve": "reads pickles",
    "socket": "talks to the network",
    "http": "talks to the network",
    "urllib": "talks to the network",
    "requests": "talks to the network",
    "httpx": "talks to the network",
    "aiohttp": "talks to the network",
    "ftplib": "talks to the network",
    "smtplib": "talks to the network",
}
# The loader of palpate.capture.schema, which is a SafeLoader.
SAFE_LOADERS = {"yaml.SafeLoader", "yaml.CSafeLoader", "_UniqueKeys"}
# A rule's shell line would take names of captures into a shell.
SHELL_DIRECTIVE = re.compile(r"^\s+(shell|run):", re.MULTILINE)


def unsafe_code(path: str | Path) -> list[str]:
    """Say what a Python file does that none of the workflow's may, a line for each.

    Parameters
    ----------
    path : path
        Python source.

    Returns
    -------
    list of str
        ``<file>:<line>: <what>: <why>``.
    """
    tree = ast.parse(Path(path).read_text(encoding="utf-8"), str(path))
    return [f"{path}:{line}: {what}" for node in ast.walk(tree) for line, what in _faults(node)]


def unsafe_rules(path: str | Path) -> list[str]:
    """Say which rules of a Snakefile are more than a script, a line for each."""
    text = Path(path).read_text(encoding="utf-8")
    return [
        f"{path}:{text.count(chr(10), 0, found.start()) + 1}: {found.group(1)}: rules are scripts"
        for found in SHELL_DIRECTIVE.finditer(text)
    ]


def unsafe_workflow(root: str | Path) -> list[str]:
    """All of that in a project's Snakefile, rules, scripts and library."""
    root = Path(root)
    lines = [line for path in sorted(root.glob("workflow/**/*.py")) for line in unsafe_code(path)]
    rules = [root / "Snakefile", *sorted(root.glob("workflow/**/*.smk"))]
    return lines + [line for path in rules for line in unsafe_rules(path)]


def _faults(node: ast.AST) -> Iterator[tuple[int, str]]:
    if isinstance(node, ast.Import):
        for one in node.names:
            yield from _of_module(node.lineno, one.name)
    elif isinstance(node, ast.ImportFrom):
        yield from _of_module(node.lineno, node.module or "")
    elif isinstance(node, ast.Call):
        yield from _of_call(node)


def _of_module(line: int, name: str) -> Iterator[tuple[int, str]]:
    top = name.partition(".")[0]
    if top in FORBIDDEN_MODULES:
        yield line, f"import {name}: {FORBIDDEN_MODULES[top]}"


def _of_call(node: ast.Call) -> Iterator[tuple[int, str]]:
    name = ast.unparse(node.func)
    options = {one.arg: ast.unparse(one.value) for one in node.keywords}
    if name in FORBIDDEN_CALLS:
        yield node.lineno, f"{name}: {FORBIDDEN_CALLS[name]}"
    if options.get("shell", "False") != "False":
        yield node.lineno, f"{name}: gives a text to a shell"
    if name in ("np.load", "numpy.load") and options.get("allow_pickle") != "False":
        yield node.lineno, f"{name}: may run a pickle without allow_pickle=False"
    if name == "yaml.load" and options.get("Loader") not in SAFE_LOADERS:
        yield node.lineno, f"{name}: may make objects of YAML without a safe loader"

"""The help of each command ends with an example, and it runs as it stands."""

import re
import shlex
import shutil

import pytest
from import_help import ros1
from instruments import PLAIN
from palpate.__main__ import main


def nothing(root, folder, film):
    """A new object needs nothing."""


def sponge(root, folder, film):
    """The own object's captures under another name."""
    own = root / "tests/own_object"
    for name in ("sensors", "probes"):
        shutil.copytree(own / name, folder / "config" / name)
    shutil.copytree(own / "raw/toy_cow", folder / "raw/sponge")
    path = folder / "raw/sponge/object.yaml"
    path.write_text(path.read_text().replace("object: toy_cow", "object: sponge"))


def recording(root, folder, film):
    ros1(folder, film).rename(folder / "press.bag")


def curve(root, folder, film):
    (folder / "curve.csv").write_bytes(PLAIN.content())


NEEDED = {"hertz": curve, "new": nothing, "import": recording, "check": sponge}


@pytest.mark.parametrize("verb", NEEDED)
def test_the_example_runs(verb, root, tmp_path, film, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit, match="0"):
        main([verb, "--help"])
    last = capsys.readouterr().out.rstrip().splitlines()[-1]
    example = re.fullmatch(rf"  palpate ({verb} .+)", last).group(1)
    NEEDED[verb](root, tmp_path, film)
    assert main(shlex.split(example)) == 0

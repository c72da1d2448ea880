"""Locked packages have hashes, the environment is the lock's, and no job needs a network."""

import shutil
import subprocess
import sys
from importlib.metadata import distribution

import pytest
from house.audit import audited, changed_files, normal, read_lock


def test_every_locked_package_has_hashes(root):
    lock = read_lock(root / "environment.lock")
    assert len(lock) > 100
    assert all(one.hashes for one in lock)
    assert len({one.name for one in lock}) == len(lock)


def test_what_people_ask_for_is_locked(root):
    locked = {one.name for one in read_lock(root / "environment.lock")}
    rows = (root / "environment.in").read_text().splitlines()
    asked = {normal(row.partition("==")[0]) for row in rows if row and row[0] != "#"}
    assert asked <= locked


@pytest.mark.parametrize(
    "line", ["numpy==2.4.6", "numpy>=2 --hash=sha256:" + "0" * 64, "git+https://a.example/b.git"]
)
def test_a_package_without_version_or_hash(tmp_path, line):
    path = tmp_path / "a.lock"
    path.write_text(f"# made by hand\n{line}\n")
    with pytest.raises(ValueError, match="a.lock: package: expected name==version and hashes"):
        read_lock(path)


def test_the_environment_is_the_locks(root):
    rows, problems = audited(read_lock(root / "environment.lock"))
    assert problems == []
    assert all(row.installed == row.locked for row in rows)
    _, problems = audited([])
    assert any(line.startswith("numpy: lock: expected a locked package") for line in problems)


def test_a_changed_file_is_seen(tmp_path, monkeypatch):
    there = distribution("jsonschema")
    assert list(changed_files(there)) == []
    file = next(one for one in there.files if one.hash and one.suffix == ".py")
    file.hash.value = "another"
    changed = type("Changed", (), {"files": [file], "metadata": there.metadata})()
    (line,) = changed_files(changed)
    assert "expected the installed file, found another" in line


def test_no_job_needs_a_network(root, tmp_path):
    """A real target in a namespace without any network: from the background to the table."""
    unshare = shutil.which("unshare")
    alone = [unshare or "", "--net", "--map-root-user"]
    if not unshare or subprocess.run([*alone, "true"], capture_output=True).returncode:
        pytest.skip("unshare --net is not there or not permitted on this machine")
    for name in ("Snakefile", "config", "workflow"):
        source = root / name
        copy = shutil.copytree if source.is_dir() else shutil.copy
        copy(source, tmp_path / name)
    shutil.copytree(root / "tests/sample", tmp_path / "tests/sample")
    target = "results/sample/foam_block/kinect/support_plane.json"
    command = ["-m", "snakemake", "--profile", "workflow/profiles/default"]
    sample = ["--configfile", "tests/sample/config.yaml", "--", target]
    done = subprocess.run(
        [*alone, sys.executable, *command, *sample], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert (tmp_path / target).is_file()

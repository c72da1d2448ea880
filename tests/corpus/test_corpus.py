"""Corrupted inputs end as the committed table says, of which each line was read."""

import subprocess
import sys

import corpus
from corrupted import doors


def test_each_ends_as_it_is_known_to(root):
    command = [sys.executable, str(root / "tools/corpus.py"), "--fast"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_whatever_is_rejected_gets_a_clear_line():
    for entry, (end, line) in corpus.expected().items():
        assert end in doors.ENDS, entry
        assert doors.clear(line) or end not in (doors.BY_FORM, doors.BY_CONTENT), entry

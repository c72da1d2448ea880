"""What tests of the parts of `palpate calibrate` share; a module names its part as PART."""

import pytest
from palpate.__main__ import main


@pytest.fixture
def refused(capsys, request):
    """The one line with which the command refuses."""

    def line(*arguments):
        assert main(["calibrate", request.module.PART, *map(str, arguments)]) == 1
        shown = capsys.readouterr()
        assert shown.out == ""
        (found,) = shown.err.splitlines()
        return found

    return line


@pytest.fixture
def given(capsys, request):
    """What the command prints."""

    def printed(*arguments):
        assert main(["calibrate", request.module.PART, *map(str, arguments)]) == 0
        return capsys.readouterr().out

    return printed

"""How a run ends that can't begin."""

import pytest
from palpate.run.refusal import refuse, require_values


def test_a_refusal_is_its_lines_and_the_exit_status_1(capsys):
    with pytest.raises(SystemExit) as end:
        refuse(ValueError("a.yaml: unit: expected m\nb.yaml: unit: expected mm"))
    assert end.value.code == 1 and end.value.__suppress_context__
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err == "error: a.yaml: unit: expected m\nerror: b.yaml: unit: expected mm\n"


def test_an_option_without_a_value():
    require_values({"only": "cushion", "seed": 0})
    said = r"^--config only=: expected a value, found nothing \(leave it out"
    with pytest.raises(ValueError, match=said):
        require_values({"only": None, "seed": 3})

"""The checker of what people drop in; what it says of what is wrong: tests/corpus."""

from palpate.__main__ import main
from palpate.capture.check import check_object
from palpate.capture.devices import read_device


def test_sample_is_right(root, specifications):
    assert check_object(root / "tests/sample/raw/foam_block", *specifications) == []


def test_names_are_kept_wherever_one_comes_in(block, specifications, root, tmp_path):
    path = block / "object.yaml"
    path.write_text(path.read_text().replace("object: foam_block", "object: simulations"))
    (line,) = check_object(block.rename(block.with_name("simulations")), *specifications)
    assert "object: expected a name of letters, digits and _ other than sensors and sim" in line
    text = (root / "tests/sample/sensors/kinect.yaml").read_text()
    (tmp_path / "curve.yaml").write_text(text.replace("sensor: kinect", "sensor: curve"))
    _, (line,) = read_device(tmp_path / "curve.yaml", "sensors")
    assert "curve.yaml: sensor: expected a name of small letters, digits and _ other than" in line


def test_all_problems_at_once(block, specifications):
    (block / "kinect/08/color/000003.png").write_bytes(b"")
    (block / "kinect/08/force.csv").unlink()
    assert len(check_object(block, *specifications)) == 2


def test_command_line(block, root, monkeypatch, capsys):
    """From within the object's folder, too."""
    places = {"--sensors": root / "tests/sample/sensors", "--probes": root / "config/probes"}
    options = [str(part) for pair in places.items() for part in pair]
    monkeypatch.chdir(block)
    assert main(["check", ".", *options]) == 0
    assert "kinect/08: 10 frames over 3.00 s" in capsys.readouterr().out
    (block / "kinect/08/force.csv").unlink()
    assert main(["check", str(block), *options]) == 1
    assert "force.csv" in capsys.readouterr().out

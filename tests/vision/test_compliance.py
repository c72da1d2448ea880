"""Compliance of a probe, from indentations whose stiffness is known, and its command."""

import json

import numpy as np
import pandas as pd
import pytest
import yaml
from palpate.capture.tables import write_table
from palpate.config.model import problems
from palpate.config.probe import ProbeSpec
from palpate.vision.compliance import find_compliance
from palpate.workflow.options import partly

STIFFNESS_N_M = 2e4
FAR_M = 0.013


def press(count=300, *, most_n=5.0, back=True, force_std_n=0.0, seed=0):
    """Force of a slow press and the way back, its zero off, and the same with noise."""
    place = np.linspace(0, 1, count)
    clean = most_n * (np.sin(np.pi * place) if back else place)
    return clean, clean + np.random.default_rng(seed).normal(0, force_std_n, count)


def seen(way_m, std_m=5e-5, seed=1):
    """A way as a board tells it, from any zero."""
    return FAR_M + way_m + np.random.default_rng(seed).normal(0, std_m, len(way_m))


@pytest.mark.parametrize("alike", [0.0, 0.7])
@pytest.mark.parametrize("stiffness_n_m", [3e3, 2e4, 1e5])
def test_deviations_hold(stiffness_n_m, alike):
    """Of independent errors, and of ones that hang together from frame to frame."""
    rng, parts = np.random.default_rng(4), []
    for seed in range(300):
        clean, force = press(force_std_n=0.02, seed=seed)
        error = rng.normal(0, 5e-5, len(clean))
        for k in range(1, len(error)):
            error[k] = alike * error[k - 1] + np.sqrt(1 - alike**2) * error[k]
        found = find_compliance(FAR_M + clean / stiffness_n_m + error, force)
        off = found.compliance_m_n - 1 / stiffness_n_m
        parts.append(off / found.compliance_std_m_n)
    # Of 300 draws a deviation's own is 4 %; what hangs together is told less sharply.
    np.testing.assert_allclose(np.std(parts), 1, atol=0.12 if alike == 0 else 0.2)
    assert abs(np.mean(parts)) < 4 / np.sqrt(300)


def test_noise_of_the_force_does_not_flatten():
    """Of a tenth of a newton in a press of three; a plain line is off by a hundredth."""
    slopes, plain = [], []
    for seed in range(200):
        clean, force = press(most_n=3.0, force_std_n=0.1, seed=seed)
        way = seen(clean / STIFFNESS_N_M, 1e-5, seed + 1000)
        slopes.append(find_compliance(way, force).compliance_m_n * STIFFNESS_N_M)
        kept = force > 0.5
        plain.append(np.polyfit(force[kept], way[kept], 1)[0] * STIFFNESS_N_M)
    error = np.std(slopes) / np.sqrt(200)
    assert abs(np.mean(slopes) - 1) < 4 * error
    assert abs(np.mean(plain) - 1) > 4 * error


def test_what_nothing_gives_way_in_is_not_told():
    told = []
    for seed in range(100):
        found = find_compliance(seen(0.0 * press()[0], seed=seed), press()[0])
        told.append(found.determined)
        assert found.least_n_m > 1e5
    assert np.mean(told) < 0.03


def test_bounds_of_what_is_hardly_told():
    """Nineteen of twenty hold."""
    truth, held = 2.5e5, []
    for seed in range(300):
        clean, force = press(force_std_n=0.02, seed=seed)
        found = find_compliance(seen(clean / truth, seed=seed + 1000), force)
        held.append(found.least_n_m < truth)
    assert 0.92 < np.mean(held) < 0.98


WEIGHTS_N = np.repeat(np.linspace(1, 5, 5), 2)


@pytest.mark.parametrize(
    ("force", "std_m", "apart"),
    [
        (press(back=False)[0], 5e-5, False),
        (np.tile(press()[0], 3), 5e-5, True),
        (WEIGHTS_N, 5e-6, False),
    ],
)
def test_loading_alone_presses_one_after_another_and_weights_that_hang(force, std_m, apart):
    found = find_compliance(seen(force / STIFFNESS_N_M, std_m), force)
    assert abs(found.stiffness_n_m - STIFFNESS_N_M) < 4 * found.std_n_m
    assert np.isfinite(found.gap_m[0]) == apart
    assert not abs(found.gap_m[0]) > 4 * found.gap_m[1]


def test_no_press_of_a_rigid_thing_is_refused_by_chance():
    for seed in range(300):
        clean, force = press(force_std_n=0.02, seed=seed)
        find_compliance(seen(clean / STIFFNESS_N_M, 2e-4, seed + 1000), force)


# A ball in foam of 40 kPa: way over the power 2/3 of force, 7 mm at 5 N.
FOAM_M = seen((3 * press()[0] / (4 * 4e4 * np.sqrt(0.006))) ** (2 / 3), 2e-4)
WAY_M = press()[0] / STIFFNESS_N_M
APART = "expected loading and unloading alike, found unloading"


@pytest.mark.parametrize(
    ("force", "way", "line"),
    [
        (press(20, most_n=0.52)[0], None, r"10 samples or more above 0.5 N, found \d+ of 20$"),
        (-press()[0], seen(WAY_M), r"found 0 of 300 \(presses are positive here: turn the sign"),
        (press(most_n=1.3)[0], None, r"expected a press over 1 N .* found 0\.79 N; press"),
        (press(most_n=2.0, force_std_n=0.2)[1], None, r"expected a press over [345][.\d]* N or"),
        (press(most_n=5000)[0], None, "expected newtons of an operator, found 5000 N"),
        (press()[0], FOAM_M, "way: expected it in proportion to the force, found it"),
        (press()[0], seen(press()[0] / 800, 5e-6), "way: expected 2000 N/m or more, found 800:"),
        (press()[0], 1e3 * seen(WAY_M), "the unit of the way right"),
        (press()[0], -seen(WAY_M), "way: expected it to grow with the force, found it 0.2"),
        (press()[0], seen(WAY_M + 1e-4 * (np.arange(300) > 150), 2e-5), APART),
        (press()[0], seen(np.roll(WAY_M, 15), 2e-5), APART),
    ],
)
def test_what_is_no_probe_on_something_rigid(force, way, line):
    with pytest.raises(ValueError, match=line):
        find_compliance(seen(force / STIFFNESS_N_M) if way is None else way, force)


PART = "stiffness"


@pytest.fixture
def table(tmp_path):
    """A table of a press to 5 N and back, seen to 0.05 mm."""

    def written(stiffness_n_m=2e4, power=1.0, names=("depth_m", "force_n"), scale=(1, 1)):
        rng, path = np.random.default_rng(0), tmp_path / "press.csv"
        force = 5 * np.sin(np.linspace(0, np.pi, 300))
        way = 0.01 + (force / stiffness_n_m) ** power + rng.normal(0, 5e-5, 300)
        columns = way * scale[0], (force + rng.normal(0, 0.02, 300)) * scale[1]
        write_table(path, pd.DataFrame(dict(zip(names, columns, strict=True))))
        return path

    return written


def test_a_table(table, given, tmp_path):
    out = tmp_path / "stiffness.json"
    text = given(table(), "--output", out)
    assert "samples in contact, 0.5" in text
    assert "  stiffness: determined, to " in text
    found = json.loads(out.read_text())
    assert abs(found["stiffness_n_m"] - 2e4) < 4 * found["stiffness_std_n_m"]
    block = yaml.safe_load(text[text.index("\nstiffness_n_m:") : text.index("written")])
    assert block["stiffness_n_m"] == pytest.approx(found["stiffness_n_m"], rel=0.005)
    assert block["compliance_std_m_n"] == pytest.approx(found["compliance_std_m_n"], rel=0.05)
    assert not problems(partly(ProbeSpec), block)


def test_other_columns_and_units(table, given):
    plain = given(table())
    path = table(names=("weg (mm)", "fz"), scale=(1e3, 1e3))
    other = given(path, "--force-unit", "mN", "--force-column", "fz")
    assert plain.splitlines()[2:] == other.splitlines()[2:]
    assert "depth in mm" in other and "force in mN" in other


def test_a_handle_of_steel_is_left_out_of_the_file(table, given, tmp_path):
    out = tmp_path / "stiffness.json"
    text = given(table(1e7), "--output", out)
    assert "stiffness: not determined, stiffer than " in text
    assert "N/m (95 %): leave it out of the probe's file" in text
    assert "\nstiffness_n_m" not in text
    found = json.loads(out.read_text())
    line = yaml.safe_load(text[text.index("\ncompliance_std_m_n") : text.index("written")])
    parts = found["compliance_m_n"], found["compliance_std_m_n"]
    assert line["compliance_std_m_n"] == pytest.approx(np.hypot(*parts), rel=0.05)
    assert found["stiffness_n_m"] is None and 1e5 < found["stiffer_than_n_m"] < 1e7


def test_weights_on_paper(given, tmp_path):
    """Without noise nothing is surer than 1e-8 m/N, in digits that are read."""
    path, force = tmp_path / "weights.csv", np.arange(1, 12) * 0.5
    write_table(path, pd.DataFrame({"depth_m": force / 2e4, "force_n": force}))
    text = given(path)
    assert text.endswith("stiffness_n_m: 20000\ncompliance_std_m_n: 1.0e-08\n")


def test_no_table_or_one_without_force(table, refused, tmp_path):
    line = refused(table(names=("depth_m", "time_s")))
    assert "expected one column of force" in line
    none = tmp_path / "nowhere.csv"
    line = f"{none}: source: expected a recording or a table, found none"
    assert line in refused(none)
    assert line in refused(none, "--sensor", tmp_path / "none.yaml")
    assert "frames.csv: expected a recording's, found none" in refused(tmp_path)

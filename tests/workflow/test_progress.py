"""What a run shows: progress, closing lines, and its time and memory by rule."""

import io
import logging
import os
import re
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest
import yaml
from palpate.modulus import VERDICTS
from palpate.report import tables
from palpate.report.estimate_rows import summary
from palpate.workflow.closing import closing_lines
from palpate.workflow.progress import Pace, Terminal
from palpate.workflow.resources import main, resource_table
from slurm_resources import requests
from snakemake.logging import ColorizingTextHandler
from snakemake_interface_logger_plugins.common import LogEvent
from thesis import artefacts

JOBS = {"clouds": 2, "track": 2}


@pytest.fixture
def terminal(tmp_path):
    """A logger with a terminal; what it shows, its pace, its file and its clock."""
    logger, shown, clock = logging.Logger("run", logging.INFO), io.StringIO(), [0.0]
    pace = Pace(JOBS, tmp_path, clock=lambda: clock[0])
    log = tmp_path / "logs/progress.log"
    logger.addHandler(Terminal(ColorizingTextHandler(stream=shown), pace, log))
    return SimpleNamespace(logger=logger, shown=shown, log=log, clock=clock)


def begins(terminal, number, rule, message):
    info = {"jobid": number, "rule_name": rule, "rule_msg": message}
    terminal.logger.info("Rule", extra={"event": LogEvent.JOB_INFO, **info})


def finishes(terminal, number, done):
    terminal.logger.info("Done", extra={"event": LogEvent.JOB_FINISHED, "job_id": number})
    count = {"done": done, "total": 4}
    terminal.logger.info("count", extra={"event": LogEvent.PROGRESS, **count})


def fails(terminal, logs, **aux):
    """What Snakemake says of a job that failed."""
    error = {"event": LogEvent.ERROR, "exception": "RuleException"}
    terminal.logger.error("RuleException:\nCalledProcessError", extra=error)
    job = {"rule_name": "clouds", "output": ["08/clouds.npz"], "log": [str(logs)], "aux": aux}
    terminal.logger.error("Error in rule clouds", extra={"event": LogEvent.JOB_ERROR, **job})


def test_a_job_that_begins_is_one_line_on_the_terminal_and_in_the_file(terminal):
    begins(terminal, 1, "clouds", "Clouds of pad, kinect, 08")
    for _ in range(2):
        terminal.logger.info("Select jobs to execute...")
    finishes(terminal, 1, 1)
    terminal.clock[0] = 3700.0
    begins(terminal, 2, "track", "Tracking of pad, kinect, 08")
    begins(terminal, 3, "all", None)
    lines = terminal.shown.getvalue().splitlines()
    assert lines == [
        "0:00:00  0 of 4 steps (0%) done, now: Clouds of pad, kinect, 08",
        "Select jobs to execute...",
        "1:01:40  1 of 4 steps (25%) done, about 185 min left, now: Tracking of pad, kinect, 08",
    ]
    assert terminal.log.read_text().splitlines() == lines[::2]


def test_a_script_that_failed_here_has_said_so_and_one_of_a_cluster_is_one_line(terminal, tmp_path):
    line = "error: clouds/08: clouds.npz: expected points, found none (log: 08.log)"
    (tmp_path / "08.log").write_text(f"reading\n{line}\n")
    fails(terminal, tmp_path / "08.log")
    assert terminal.shown.getvalue() == ""
    fails(terminal, tmp_path / "08.log", external_jobid=3)
    assert terminal.shown.getvalue() == f"{line}\n"


@pytest.mark.parametrize("text", [None, "reading\n", "error: of the last run\n"])
def test_a_job_that_was_killed_is_one_line(terminal, tmp_path, text):
    if text is not None:
        (tmp_path / "08.log").write_text(text)
    terminal.logger.handlers[0].began = time.time() + ("last" in (text or ""))
    fails(terminal, tmp_path / "08.log")
    (line,) = terminal.shown.getvalue().splitlines()
    assert line.startswith("error: clouds: 08/clouds.npz: expected it to be made, found")
    assert line.endswith(f"(log: {tmp_path}/08.log)")


def written(folder, **rows):
    """Benchmarks of rules."""
    for name, row in rows.items():
        path = folder / f"{name.replace('__', '/')}.tsv"
        path.parent.mkdir(exist_ok=True, parents=True)
        path.write_text(f"s\th:m:s\tmax_rss\tcpu_time\n{row}\n")
    return folder


def test_the_last_run_shows_the_time_left_until_this_one_does(tmp_path):
    known = {"clouds__a": 10.0, "clouds__b": 30.0, "lab_capture": 1e6, "track": "NA"}
    written(tmp_path, **{name: f"{time_s}\t0:00:01\t-\t-" for name, time_s in known.items()})
    clock = [0.0]
    pace = Pace({"clouds": 30, "track": 30}, tmp_path, cores=2, clock=lambda: clock[0])
    # 20 s a job, of a rule without a benchmark too: 1200 s on two cores.
    assert pace.line().endswith(", about 10 min left")
    pace.rules |= dict.fromkeys(range(60), "track")
    pace.finished += range(30)
    clock[0] = 1200.0  # four times as long
    assert pace.line().endswith("30 of 60 steps (50%) done, about 18 min left")
    pace.finished += range(30, 60)
    assert pace.line().endswith("60 of 60 steps (100%) done, less than a minute left")


@pytest.fixture
def ball(tmp_path):
    """A results folder with a summary of the workflow's own columns."""
    known = {"object": "ball", "sensor": "kinect", "provenance": "simulated"}
    hertz = {"point": "08", "capture": "08", "method": "hertz", "reduced_modulus_pa": 25e3}
    joint = {"point": "all", "capture": "all", "method": "direct_joint", "captures": 3}
    joint |= {"poisson_ratio": 0.4, "poisson_ratio_low": 0.25, "poisson_ratio_high": 0.49}
    joint |= {"recommended": True, "poisson_ratio_verdict": "bounded"}
    moduli = {"youngs_modulus": 250e3, "youngs_modulus_1s": 225e3, "reduced_modulus": 298e3}
    for quantity, value in (moduli | {"effective_reduced_modulus": 310e3}).items():
        joint |= {f"{quantity}_pa": value, f"{quantity}_low_pa": 0.9 * value}
        joint |= {f"{quantity}_high_pa": 1.1 * value, f"{quantity}_verdict": "identified"}
    table = tables.rounded(summary([known | hertz, known | joint]))
    table.to_csv(tmp_path / "summary.csv", index=False)
    (tmp_path / "tables").mkdir()
    for name in ("objects.html", "report.html"):
        (tmp_path / name).write_text("made")
    return tmp_path


def test_closing_gives_the_recommended_moduli_first_with_intervals_and_verdicts(ball):
    lines = closing_lines(ball)
    assert lines[0].endswith(": objects.html, report.html, summary.csv, tables/")
    place = lines.index("ball, kinect (simulated: captures of the virtual lab)")
    assert lines[place + 1 : place + 7] == [
        "  effective E*    310.0 kPa (279.0 to 341.0), identified",
        "  instantaneous E 250.0 kPa (225.0 to 275.0), identified",
        "  E at 1 s        225.0 kPa (202.5 to 247.5), identified",
        "  nu              0.40 (0.25 to 0.49), bounded",
        "  E*              298.0 kPa (268.2 to 327.8), identified",
        "  from 3 captures",
    ]
    assert f"bounded: {VERDICTS['bounded']}." in lines
    browse = f"For a browser: {ball}/report.html"
    assert browse in lines
    (ball / "report.html").unlink()
    assert browse not in closing_lines(ball)


def test_jobs_are_summed_up_by_rule_and_part(tmp_path):
    rows = {"clouds__a": "10.0\t0:00:10\t400\t8.0", "clouds__b": "30.0\t0:00:30\t300\t20.5"}
    rows |= {"lab_capture__a": "100.0\t0:01:40\t600\t90", "lab_fidelity": "5.0\t0:00:05\t200\t4"}
    table = resource_table(written(tmp_path / "benchmarks", **rows, summary="0.2\t0:00:00\tNA\t-"))
    rules = ["lab_capture", "clouds", "lab_fidelity", "summary", "total", "total"]
    assert list(table["rule"]) == rules
    clouds = table[table["rule"] == "clouds"].iloc[0]
    assert tuple(clouds)[1:] == ("pipeline", 2, 40.0, 30.0, 28.5, 400.0)
    lab, pipeline = table[table["rule"] == "total"].itertuples(index=False)
    assert (lab.part, lab.jobs, lab.total_s, lab.peak_memory_mb) == ("lab", 1, 100.0, 600.0)
    assert (pipeline.part, pipeline.jobs, pipeline.total_s) == ("pipeline", 4, 45.2)
    main(tmp_path)
    text = (tmp_path / "tables/resources.md").read_text()
    assert "| summary | pipeline | 1 | 0 | 0 | 0 |  |" in text


def test_bad_benchmarks_are_refused(tmp_path):
    (tmp_path / "clouds.tsv").write_text("s\tmax_rss\n1\t2\n")
    with pytest.raises(ValueError, match=r"clouds\.tsv: cpu_time: expected a column, found none"):
        resource_table(tmp_path)


def test_a_run_that_left_nothing_ends_in_one_line(root, tmp_path):
    command = [sys.executable, "-m", "palpate.workflow.resources", tmp_path]
    library = os.environ | {"PYTHONPATH": str(root / "workflow/scripts")}
    done = subprocess.run(command, capture_output=True, text=True, env=library, check=False)
    assert done.returncode == 1
    line = f"error: resources: {tmp_path}/benchmarks: expected benchmarks of a run, found none\n"
    assert done.stderr == line
    assert not (tmp_path / "tables").exists()


def test_the_largest_job_with_a_margin_and_twice_as_much_at_each_retry(tmp_path):
    rows = {"track__a": "59\t0:00:59\t700.0\t20", "track__b": "61\t0:01:01\t301.0\t20"}
    benchmarks = written(tmp_path, **rows, summary="0.4\t0:00:00\tNA\tNA")
    asked = yaml.safe_load(requests(benchmarks))["set-resources"]
    found = {
        rule: [tuple(eval(text, {"attempt": n}) for text in of.values()) for n in (1, 2)]
        for rule, of in asked.items()
    }
    # 1.5 x 700 + 400 MB, in steps of 100; twice 61 s and the time to read the workflow.
    assert found == {"summary": [(400, 3), (800, 6)], "track": [(1500, 5), (3000, 10)]}


def test_names_of_the_profile_are_rules(root):
    profile = yaml.safe_load((root / "workflow/profiles/slurm/config.yaml").read_text())
    text = "".join(path.read_text() for path in (root / "workflow").rglob("*.smk"))
    rules = set(re.findall(r"^ *(?:rule|use rule \w+ as) (\w+)", text, re.MULTILINE))
    rules |= {entry.name for entry in artefacts.ARTEFACTS}
    assert set(profile["groups"]) <= rules
    assert set(profile["group-components"]) <= set(profile["groups"].values())
    assert {"track", "indentation", "direct"} <= set(profile["set-resources"])

"""What a run shows on the terminal."""

import io
import logging
import time
from types import SimpleNamespace

import pytest
from palpate.workflow.progress import Pace, Terminal
from snakemake.logging import ColorizingTextHandler
from snakemake_interface_logger_plugins.common import LogEvent

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


def test_the_last_step_and_other_errors_are_shown_as_snakemake_does(terminal):
    error = {"event": LogEvent.ERROR, "exception": "MissingOutputException"}
    terminal.logger.error("MissingOutputException in rule clouds", extra=error)
    finishes(terminal, 4, 4)
    shown = terminal.shown.getvalue().splitlines()
    assert shown == ["MissingOutputException in rule clouds", "count"]


def test_a_script_that_failed_here_has_said_so_and_one_of_a_cluster_is_one_line(terminal, tmp_path):
    line = "error: clouds/08: clouds.npz: expected points, found none (log: 08.log)"
    (tmp_path / "08.log").write_text(f"reading\n{line}\n")
    fails(terminal, tmp_path / "08.log")
    assert terminal.shown.getvalue() == ""
    fails(terminal, tmp_path / "08.log", external_jobid=3)
    assert terminal.shown.getvalue() == f"{line}\n"


@pytest.mark.parametrize("text", [None, "reading\n", "error: of the last run\n"])
def test_a_job_that_was_killed_is_one_line(terminal, tmp_path, text, monkeypatch):
    if text is not None:
        (tmp_path / "08.log").write_text(text)
    terminal.logger.handlers[0].began = time.time() + ("last" in (text or ""))
    fails(terminal, tmp_path / "08.log")
    (line,) = terminal.shown.getvalue().splitlines()
    assert line.startswith("error: clouds: 08/clouds.npz: expected it to be made, found")
    assert line.endswith(f"(log: {tmp_path}/08.log)")


def bench(folder, name, seconds):
    path = folder / f"{name}.tsv"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"s\th:m:s\tmax_rss\tcpu_time\n{seconds}\t0:00:01\t-\t-\n")


def test_the_last_run_shows_the_time_left_until_this_one_does(tmp_path):
    known = {"clouds/a": 10.0, "clouds/b": 30.0, "lab_capture": 1e6, "track": "NA"}
    for name, seconds in known.items():
        bench(tmp_path, name, seconds)
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


def test_nothing_is_said_of_the_time_left_before_anything_shows_it(tmp_path):
    pace = Pace({"clouds": 40}, tmp_path / "none")
    assert "left" not in pace.line() and "left" not in Pace({}, tmp_path).line()

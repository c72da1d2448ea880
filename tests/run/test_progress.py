"""What a run shows on the terminal."""

import io
import logging

import pytest
from palpate.run.pace import Pace
from palpate.run.progress import ENDING, ENDS, Plan, be_brief


@pytest.fixture
def terminal():
    """A logger with a terminal, and what it shows."""
    logger, shown = logging.Logger("run", logging.INFO), io.StringIO()
    logger.addHandler(logging.StreamHandler(shown))
    return logger, shown


def job(logger, message):
    logger.info(None, extra={"event": "job_info", "rule_msg": message})


def progress(logger, done, total):
    logger.info(f"{done}/{total}", extra={"event": "progress", "done": done, "total": total})


def test_a_job_that_begins_is_one_line_beside_the_steps_done(terminal):
    logger, shown = terminal
    be_brief(logger, 4)
    job(logger, "Clouds of pad, kinect, 08")
    logger.info("Finished", extra={"event": "job_finished", "job_id": 1})
    progress(logger, 1, 4)
    logger.info("Select jobs to execute...")
    job(logger, "Hertz fit of pad, kinect, 08")
    job(logger, None)
    lines = shown.getvalue().splitlines()
    assert len(lines) == 2
    assert lines[0].endswith("0 of 4 steps (0%) done, now: Clouds of pad, kinect, 08")
    assert lines[1].endswith("1 of 4 steps (25%) done, now: Hertz fit of pad, kinect, 08")


def test_a_line_says_what_is_left_once_something_tells_it(terminal):
    logger, shown = terminal
    be_brief(logger, 3, Pace({1: 60.0, 2: 600.0, 3: 840.0}, measured=True, cores=2))
    job(logger, "Clouds of pad")
    logger.info("Finished", extra={"event": "job_finished", "job_id": 2})
    logger.info("Finished", extra={"event": "job_finished", "job_id": 3})
    job(logger, "Forces of pad")
    first, second = shown.getvalue().splitlines()
    # 1500 s on two cores; then a minute's work where a moment did for the rest.
    assert first.endswith("0 of 3 steps (0%) done, about 13 min left, now: Clouds of pad")
    assert second.endswith("done, less than a minute left, now: Forces of pad")


def fails(logger, status, **where):
    """What Snakemake says of a job that failed."""
    error = f"RuleException:\nCalledProcessError in file a.smk, line 3:\nCommand 'b' {status}."
    logger.error(error, extra={"event": "error"})
    job = {"rule_name": "clouds", "output": ["08/clouds.npz"], "log": ["logs/08.log"]}
    job |= {"event": "job_error", "aux": {}, "indent": False} | where
    logger.error("Error in rule clouds", extra=job)
    logger.info("Shutting down, this might take some time.")
    logger.error("Exiting because a job execution failed. Look above for error messages")


def test_of_a_job_that_failed_its_own_line_is_all(terminal):
    logger, shown = terminal
    be_brief(logger, 1)
    fails(logger, "returned non-zero exit status 1")
    assert shown.getvalue() == ""


@pytest.mark.parametrize(
    "status", ["died with <Signals.SIGKILL: 9>", "returned non-zero exit status 137"]
)
def test_a_job_that_was_killed_is_one_line(terminal, status):
    logger, shown = terminal
    be_brief(logger, 1)
    fails(logger, "returned non-zero exit status 1")
    fails(logger, status)
    (line,) = shown.getvalue().splitlines()
    assert line.startswith("error: clouds: 08/clouds.npz: expected it to be made, found")
    assert line.endswith("(log: logs/08.log)")


def test_a_job_of_a_cluster_is_told_as_snakemake_does(terminal):
    logger, shown = terminal
    be_brief(logger, 1)
    fails(logger, "returned non-zero exit status 1", aux={"external_jobid": 3})
    assert shown.getvalue().splitlines() == ["Error in rule clouds"]


def test_other_errors_and_the_last_step_are_shown(terminal):
    logger, shown = terminal
    be_brief(logger, 1)
    logger.error("MissingOutputException in rule clouds", extra={"event": "error"})
    progress(logger, 1, 1)
    assert shown.getvalue().splitlines() == ["MissingOutputException in rule clouds", "1/1"]


def test_a_verbose_run_and_the_log_file_keep_everything(terminal, tmp_path):
    logger, shown = terminal
    file = logging.FileHandler(tmp_path / "log")
    logger.addHandler(file)
    be_brief(logger, 1)
    logger.info("Select jobs to execute...")
    file.close()
    assert not shown.getvalue()
    assert "Select jobs" in (tmp_path / "log").read_text()
    logger.handlers[:] = [logging.StreamHandler(shown)]
    logger.setLevel(logging.DEBUG)
    be_brief(logger, 1)
    logger.info("Select jobs to execute...")
    assert "Select jobs" in shown.getvalue()


def test_a_run_that_is_asked_to_end_says_once_how_it_goes_on(terminal):
    logger, shown = terminal
    be_brief(logger, 4)
    logger.info(ENDING)
    logger.info(ENDING)
    assert shown.getvalue().splitlines() == [ENDS]


def said_of_a_plan(logger):
    logger.info("Building DAG of jobs...")
    logger.info("Using shell: /bin/bash")
    logger.info("Provided cores: 2", extra={"event": "resources_info"})
    logger.info("Job stats:", extra={"event": "run_info"})


def test_the_table_of_jobs_waits_for_the_runs_beginning(terminal, tmp_path):
    logger, shown = terminal
    logger.addHandler(logging.FileHandler(tmp_path / "log"))
    plan = Plan(logger, begins=lambda: True)
    said_of_a_plan(logger)
    assert shown.getvalue() == "Building DAG of jobs...\n"
    assert len((tmp_path / "log").read_text().splitlines()) == 4
    plan.show()
    logger.info("Job stats: more", extra={"event": "run_info"})
    told = shown.getvalue().splitlines()
    assert told[1:] == [
        "Using shell: /bin/bash", "Provided cores: 2", "Job stats:", "Job stats: more"
    ]  # fmt: skip
    logger.handlers[1].close()


def test_a_dry_run_shows_its_table_at_once(terminal):
    logger, shown = terminal
    Plan(logger, begins=lambda: False)
    said_of_a_plan(logger)
    assert len(shown.getvalue().splitlines()) == 4

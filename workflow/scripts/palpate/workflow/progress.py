"""What a run shows on the terminal: one line for each job as it starts, and what goes wrong.

Snakemake's own log file, in ``.snakemake/log``, keeps everything.
"""

import logging
import math
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from datetime import timedelta
from pathlib import Path
from statistics import fmean

from snakemake_interface_logger_plugins.common import LogEvent

from palpate.workflow.resources import resource_table

# The last run's times weigh as much as this part of the run at hand.
BEFORE = 0.1
# Nothing is said before this part of the work, known from before or done, shows how fast it goes.
LEAST = 0.05
# Of a run that ends before all is done: by a signal, by Ctrl-C or by a job that failed.
GOES_ON = (
    "Not all is done; what is done is kept, and the same command goes on where this run stopped."
)


class Terminal(logging.Handler):
    """Shows time gone by, steps done and time left at each job's start, and one line per error.

    The lines go to the ``usual`` handler, which shows all else too, and into the file ``log``.
    """

    def __init__(self, usual: logging.Handler, pace: "Pace", log: Path) -> None:
        super().__init__()
        self.usual, self.pace, self.log = usual, pace, log
        self.began, self.said = time.time(), set[str]()
        with suppress(OSError):
            log.parent.mkdir(parents=True, exist_ok=True)
            log.write_text("", encoding="utf-8")

    def emit(self, record: logging.LogRecord) -> None:
        """Show a record as one line, or as Snakemake does."""
        line = self._line(record)
        if line is None:
            self.usual.handle(record)
        elif line and (record.levelno >= logging.ERROR or self.usual.filter(record)):
            kept = {"levelno": record.levelno, "levelname": record.levelname}
            self.usual.emit(logging.makeLogRecord({"msg": line, **kept}))
            with suppress(OSError), self.log.open("a", encoding="utf-8") as stream:
                stream.write(f"{line}\n")

    def _line(self, record: logging.LogRecord) -> str | None:
        """What is said of a record: empty for nothing, None for what Snakemake says."""
        match getattr(record, "event", None):
            case LogEvent.JOB_INFO:
                self.pace.rules[record.jobid] = record.rule_name
                return f"{self.pace.line()}, now: {record.rule_msg}" if record.rule_msg else ""
            case LogEvent.JOB_FINISHED:
                self.pace.finished.append(record.job_id)
                return ""
            case LogEvent.PROGRESS:
                return None if record.done == record.total else ""
            case LogEvent.JOB_ERROR:
                return self._failure(record)
            case LogEvent.ERROR if record.exception != "RuleException":
                return None
            case LogEvent.ERROR | LogEvent.JOB_STARTED:  # a rule's: before its job's error
                return ""
            case None:  # the same again and again
                again = str(record.msg) in self.said
                self.said.add(str(record.msg))
                return "" if again else None
        return None

    def _failure(self, record: logging.LogRecord) -> str:
        """Last line of a job's log where it is its error; a script that ran here has shown it."""
        with suppress(OSError, ValueError, IndexError):
            log = Path(record.log[0])
            line = log.read_text(encoding="utf-8").splitlines()[-1]
            if line.startswith("error: ") and log.stat().st_mtime >= self.began:
                return line if record.aux else ""
        output, logs = ", ".join(record.output), ", ".join(record.log)
        ended = "its job ended without a word (killed, out of memory?)"
        made = f"{output}: expected it to be made, found that {ended}"
        return f"error: {record.rule_name}: {made} (log: {logs})"


class Pace:
    """How far a run is, and how long it still takes.

    A job is expected to take what its rule's took in the last run (``benchmarks``) on the average,
    and one of a rule that did not run then as much as all rules' on the average.
    """

    def __init__(
        self, jobs: Mapping, benchmarks: Path, cores: int = 1, clock: Callable = time.monotonic
    ) -> None:
        known = {}
        with suppress(OSError, ValueError):
            table = resource_table(benchmarks).query("rule in @jobs").set_index("rule")
            means = table["total_s"] / table["jobs"]
            known = means[means > 0].to_dict()
        other = fmean(known.values()) if known else 1.0
        self.expected_s = {rule: known.get(rule, other) for rule in jobs}
        self.whole_s = sum(count * self.expected_s[rule] for rule, count in jobs.items())
        self.known_s = BEFORE * self.whole_s if known else 0.0
        self.steps, self.cores, self.clock, self.start = sum(jobs.values()), cores, clock, clock()
        self.rules, self.finished = dict[int, str](), list[int]()

    def line(self) -> str:
        """Time gone by, steps done and, once something shows it, time left."""
        gone_s = self.clock() - self.start
        done = len(self.finished)
        count = f"{done} of {self.steps} steps ({done / max(self.steps, 1):.0%}) done"
        return f"{timedelta(seconds=int(gone_s))}  {count}{self._left(gone_s)}"

    def _left(self, gone_s: float) -> str:
        done_s = sum(self.expected_s.get(self.rules.get(job, ""), 0.0) for job in self.finished)
        if done_s + self.known_s < max(LEAST * self.whole_s, 1e-9):
            return ""
        pace = (gone_s + self.known_s / self.cores) / (done_s + self.known_s)
        minutes = math.ceil((self.whole_s - done_s) * pace / 60)
        return f", about {minutes} min left" if minutes > 1 else ", less than a minute left"

"""What a run shows on the terminal: one line for each job as it starts, and what goes wrong.

Snakemake's own log file, in ``.snakemake/log``, keeps everything.
"""

import logging
import time
from collections.abc import Callable, Iterator

from palpate.run.pace import Pace, told_left

# Said at each start and end of a job, beside its message and the count of those done.
CHATTER = ("job_started", "job_finished", "resources_info")
CHOOSING = "Select jobs to execute..."
# Said of a script that failed, just before its job's error and by the same thread; with this status
# it said why itself (workflow/scripts/job.py), with any other it was killed.
FAILED, SAID_WHY = "RuleException:\nCalledProcessError in file ", "returned non-zero exit status 1."
# Said of the run that ends with it.
NOISE = (
    "Shutting down, this might take some time.",
    "Exiting because a job execution failed.",
    "WorkflowError:\nAt least one job did not complete successfully.",
)
# Said again and again from SIGTERM until the jobs that run are done.
ENDING = "Will exit after finishing currently running jobs (scheduler)."
ENDS = "Asked to end: jobs that run are finished, no new ones begin; the same command then goes on."
# Said of a run before it begins: what it may use, and the table of its jobs.
PLAN = ("resources_info", "run_info")
SHELL = "Using shell: "
# Of a run that ends before all is done: by a signal, by Ctrl-C or by a job that failed.
GOES_ON = (
    "Not all is done; what is done is kept, and the same command goes on where this run stopped."
)


class Terminal(logging.Formatter):
    """Formats a job's message with the time gone by, the steps done and the time that is left.

    Parameters
    ----------
    usual : logging.Formatter
        Formats all other records.
    steps : int
        Of the run.
    pace : Pace, optional
        Of its jobs; without it nothing is said of the time that is left.
    clock : callable, optional
        Gives the time [s].
    """

    def __init__(
        self,
        usual: logging.Formatter,
        steps: int,
        *,
        pace: Pace | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__()
        self.pace, self.finished = pace, set[int]()
        self.usual, self.steps, self.done = usual, steps, 0
        self.clock, self.start = clock, clock()
        self.ending = False
        # By thread: whether the script that failed last did.
        self.said_why: dict[int | None, bool] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether a record is shown; those on progress are counted."""
        event = str(getattr(record, "event", ""))
        if event == "job_finished":
            self.finished.add(record.job_id)
        if event == "progress":
            self.done, self.steps = record.done, record.total
            return self.done == self.steps
        if event == "job_info" and not record.rule_msg:
            return False
        if record.msg == ENDING:
            again, self.ending = self.ending, True
            return not again
        if str(record.msg).startswith(FAILED):
            self.said_why[record.thread] = SAID_WHY in record.msg
            return False
        if event == "job_error" and _of_here(record):
            return not self.said_why.pop(record.thread, False)
        hidden = record.msg == CHOOSING or str(record.msg).startswith(NOISE)
        return event not in CHATTER and not hidden

    def format(self, record: logging.LogRecord) -> str:
        """One line for a job's start and the run's end; of the rest what Snakemake makes of it."""
        if record.msg == ENDING:
            return ENDS
        event = str(getattr(record, "event", ""))
        if event == "job_error" and _of_here(record):
            return _wordless(record)
        if event != "job_info":
            return self.usual.format(record)
        gone_s = self.clock() - self.start
        left = told_left(self.pace.left_s(self.finished, gone_s) if self.pace else None)
        minutes, seconds = divmod(int(gone_s), 60)
        hours, minutes = divmod(minutes, 60)
        share = self.done / self.steps if self.steps else 0.0
        count = f"{self.done} of {self.steps} steps ({share:.0%}) done{left}"
        return f"{hours}:{minutes:02d}:{seconds:02d}  {count}, now: {record.rule_msg}"


def _of_here(record: logging.LogRecord) -> bool:
    """Whether a job that failed ran on this terminal; a cluster's say nothing here themselves."""
    return not record.aux and not record.indent


def _wordless(record: logging.LogRecord) -> str:
    what = ", ".join(record.output)
    return (
        f"error: {record.rule_name}: {what}: expected it to be made, found that its job ended"
        f" without a word (killed, out of memory?) (log: {', '.join(record.log)})"
    )


class Plan:
    """Holds back on the terminal what is said of a run before it begins: it may be refused.

    Parameters
    ----------
    logger : logging.Logger
        Snakemake's, once it has its handlers.
    begins : callable
        Whether the run is one that begins at all, and then calls `show`.
    """

    def __init__(self, logger: logging.Logger, *, begins: Callable[[], bool]) -> None:
        self.begins = begins
        self.handlers, self.held = list(_terminals(logger)), []
        for handler in self.handlers:
            handler.addFilter(self.filter)

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether a record is shown at once; others are kept."""
        of_plan = str(getattr(record, "event", "")) in PLAN or str(record.msg).startswith(SHELL)
        if not of_plan or not self.begins():
            return True
        if record not in self.held:
            self.held.append(record)
        return False

    def show(self) -> None:
        """Show what was held back; from now on all is shown at once."""
        for handler in self.handlers:
            handler.removeFilter(self.filter)
            for record in self.held:
                handler.handle(record)


def be_brief(logger: logging.Logger, steps: int, pace: Pace | None = None) -> None:
    """Show one line a job on the terminal, unless the logger is to tell everything.

    Parameters
    ----------
    logger : logging.Logger
        Snakemake's, once it has its handlers.
    steps : int
        Of the run.
    pace : Pace, optional
        Of its jobs.
    """
    if logger.level < logging.INFO:
        return
    for handler in _terminals(logger):
        terminal = Terminal(handler.formatter or logging.Formatter(), steps, pace=pace)
        handler.setFormatter(terminal)
        handler.addFilter(terminal.filter)


def _terminals(logger: logging.Logger) -> Iterator[logging.Handler]:
    """Handlers of a logger that write to no file."""
    for handler in logger.handlers:
        to_file = isinstance(handler, logging.FileHandler)
        if isinstance(handler, logging.StreamHandler) and not to_file:
            yield handler

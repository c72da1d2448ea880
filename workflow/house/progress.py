"""What a run shows on the terminal: one line for each job as it starts, and what goes wrong.

Snakemake's own log file, in ``.snakemake/log``, keeps everything.
"""

import logging
import time
from collections.abc import Callable

# Said at each start and end of a job, beside its message and the count of those done.
CHATTER = ("job_started", "job_finished", "resources_info")
CHOOSING = "Select jobs to execute..."


class Terminal(logging.Formatter):
    """Formats a job's message with the time gone by and the number of steps done.

    Parameters
    ----------
    usual : logging.Formatter
        Formats all other records.
    steps : int
        Of the run.
    clock : callable, optional
        Gives the time [s].
    """

    def __init__(
        self, usual: logging.Formatter, steps: int, *, clock: Callable[[], float] = time.monotonic
    ) -> None:
        super().__init__()
        self.usual, self.steps, self.done = usual, steps, 0
        self.clock, self.start = clock, clock()

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether a record is shown; those on progress are counted."""
        event = str(getattr(record, "event", ""))
        if event == "progress":
            self.done, self.steps = record.done, record.total
            return self.done == self.steps
        if event == "job_info" and not record.rule_msg:
            return False
        return event not in CHATTER and record.msg != CHOOSING

    def format(self, record: logging.LogRecord) -> str:
        """One line for a job's start; of the rest what Snakemake makes of it."""
        if str(getattr(record, "event", "")) != "job_info":
            return self.usual.format(record)
        minutes, seconds = divmod(int(self.clock() - self.start), 60)
        hours, minutes = divmod(minutes, 60)
        share = self.done / self.steps if self.steps else 0.0
        count = f"{self.done} of {self.steps} steps ({share:.0%}) done"
        return f"{hours}:{minutes:02d}:{seconds:02d}  {count}  {record.rule_msg}"


def be_brief(logger: logging.Logger, steps: int) -> None:
    """Show one line a job on the terminal, unless the logger is to tell everything.

    Parameters
    ----------
    logger : logging.Logger
        Snakemake's, once it has its handlers.
    steps : int
        Of the run.
    """
    if logger.level < logging.INFO:
        return
    for handler in logger.handlers:
        to_file = isinstance(handler, logging.FileHandler)
        if isinstance(handler, logging.StreamHandler) and not to_file:
            terminal = Terminal(handler.formatter or logging.Formatter(), steps)
            handler.setFormatter(terminal)
            handler.addFilter(terminal.filter)

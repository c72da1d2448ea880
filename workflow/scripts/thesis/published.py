"""Tables that hold the study's printed values beside ours."""

from collections.abc import Sequence

import pandas as pd
from palpate.report import outputs

NOTE = "Columns published_* are the study's printed values."


def table(frame: pd.DataFrame, *, title: str, more_notes: Sequence[str] = ()) -> dict:
    """A table as it goes to CSV and to Markdown, with the note on its columns ``published_*``.

    Parameters
    ----------
    frame : DataFrame
        With a column ``provenance``.
    title : str
    more_notes : sequence of str, optional
    """
    return outputs.table(frame, title=title, more_notes=more_notes, last_notes=[NOTE])

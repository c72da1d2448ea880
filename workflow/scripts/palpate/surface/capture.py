"""Track one capture with one of the trackers."""

from collections.abc import Mapping

from palpate.surface.elastic_capture import track_by_elasticity
from palpate.surface.recorded import Recorded
from palpate.surface.study_capture import track_by_study
from palpate.surface.tracked import Tracked

TRACKERS = {"study": track_by_study, "elastic": track_by_elasticity}


def track_capture(recorded: Recorded, options: Mapping) -> Tracked:
    """Track the aligned template through all frames.

    Parameters
    ----------
    recorded : Recorded
    options : mapping
        Of the tracker, as config.yaml describes them.

    Returns
    -------
    Tracked
    """
    return TRACKERS[options["kind"]](recorded, options)

"""Track one capture with one of the trackers."""

from palpate.surface.elastic_capture import track_by_elasticity
from palpate.surface.options import ElasticTracking, StudyTracking
from palpate.surface.recorded import Recorded
from palpate.surface.study_capture import track_by_study
from palpate.surface.tracked import Tracked

TRACKERS = {"study": track_by_study, "elastic": track_by_elasticity}


def track_capture(recorded: Recorded, options: StudyTracking | ElasticTracking) -> Tracked:
    """Track the aligned template through all frames.

    Parameters
    ----------
    recorded : Recorded
    options : StudyTracking or ElasticTracking

    Returns
    -------
    Tracked
    """
    return TRACKERS[options.kind](recorded, options)

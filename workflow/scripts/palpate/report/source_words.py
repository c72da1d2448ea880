"""Sources of error as people know them, and what to do about each."""

from typing import NamedTuple

from palpate.estimate.direct.prior import RATIO, STEPS


class Words(NamedTuple):
    """What a page says of a source; of one without a unit also what its size is a part of."""

    name: str
    advice: str
    of: str = ""


FINER = (
    "Compute force and surface with finer finite elements (`direct.model.edge_m`), and state what"
    " they are off by then (`direct.fit.model_std`)."
)
# By the source's name in uncertainty_budget.csv.
SOURCES = {
    "law of the force": Words(
        "law of the force",
        "Press in smaller steps from the first touch on: how the force bends with depth tells how"
        " the material stiffens.",
        "of the way between the laws",
    ),
    "law of the motion": Words(
        "law of the surface's motion",
        "Let the camera see more of the surface beside the tip. Where the object bears more, press"
        " deeper too, with a larger `deepest_m` in `object.yaml`.",
        "of the way between the laws",
    ),
    "scale of the camera": Words(
        "scale of the camera's distances",
        "Calibrate the camera with a board at the object's distance.",
        "% of all distances",
    ),
    "relaxing shares": Words(
        "how much of E relaxes",
        "Press faster, then hold still at the deepest for 10 s or more.",
        "% of E at each time",
    ),
    STEPS: Words(
        "when it relaxes",
        "Hold still at the deepest for 10 s or more: slow relaxing needs time to show.",
        "% of E from time to time",
    ),
    RATIO: Words(
        "Poisson's ratio as it was given",
        "Give Poisson's ratio more exactly, or leave it to the captures.",
        "of nu",
    ),
    "zero of the depth": Words(
        "where the tip first touches",
        "Scan the object again for its template, and measure the tip's place on the probe: the fit"
        " has to guess where the surface was touched.",
    ),
    "clocks": Words(
        "clocks of camera and force",
        "Press more slowly, or let one clock time camera and force.",
    ),
    "zero of the motion": Words(
        "the surface at rest",
        "Film more frames before the press, with nothing moving.",
    ),
    "tip of the probe": Words(
        "place of the ball's centre in the target's frame",
        "Calibrate it: `palpate calibrate tip` (docs/rig.md).",
    ),
    "place of the contact": Words(
        "place of the contact",
        "Mark the point on the object and declare it more exactly, and press where the surface is"
        " even.",
    ),
    "sinking": Words(
        "the object sinking",
        "Put the object on something that does not give way.",
    ),
    "rocking": Words(
        "the object rocking",
        "Hold the object so that it cannot tilt.",
    ),
    "noise of the motion": Words(
        "noise of the surface's motion",
        "Bring the camera closer, light the object evenly, and record more frames or captures: the"
        " motion of the surface is known no better than the depth pictures.",
    ),
    "noise of the depth": Words(
        "noise of the tip's depth",
        "Keep the probe's board in full view and near the camera, and record more frames or"
        " captures: the tip's depth is known no better than the board's pose.",
    ),
    "captures apart": Words(
        "captures that differ",
        "Record more captures at the same point, with the same hand and the same rest between them:"
        " those there are differ by more than their noise.",
        "% of a modulus",
    ),
    "scale of the force": Words(
        "scale of the force sensor",
        "Calibrate the force sensor with known weights.",
        "% of all forces",
    ),
    "zero of the force": Words(
        "zero of the force sensor",
        "Record the force for some seconds before the touch, in the probe's pose.",
    ),
    "drift of the force": Words(
        "drift of the force sensor",
        "Let the force sensor warm up, and keep the recording short.",
    ),
    "radius of the sphere": Words(
        "radius of the tip",
        "Measure the tip with a caliper at several places.",
    ),
    "curvature of the template": Words(
        "curvature of the scanned form",
        "Scan the object again, finer around the point that is pressed.",
    ),
    "compliance of the probe": Words(
        "bending of the probe",
        "Press the probe against something hard to measure how it bends.",
    ),
    "indentation table: force": Words("finite elements: force", FINER, "% of E"),
    "indentation table: motion": Words("finite elements: surface's motion", FINER, "of nu"),
    "friction at the sphere": Words(
        "friction at the sphere", "Wet or oil the sphere, or dust it with talc.", "% of E"
    ),
    "indentation table: base friction": Words(
        "finite elements: friction at the base",
        "Bond the object to its base: the friction there is not known.",
        "of nu",
    ),
}

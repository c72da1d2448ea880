"""Figure 5.12: the ball under the force as measured and turned to the contact's normal."""

import numpy as np
from job import run
from palpate.capture.files import whole_file
from palpate.estimate.problem import pose_problem
from palpate.solid.load import contact_triangle, outward_normal
from palpate.study import force_direction, style
from palpate.study.force_direction import STUDY_E_PA, STUDY_NU
from palpate.study.tracking_views import View
from palpate.surface.tracked import load_tracked
from study_inputs import read_all
from tracking_inputs import recordings_of

TILT_DEG, TIMES = 5.0, 1.0
LEANING = f"tilted by {TILT_DEG:g}° (not measured)"


def main(snakemake):
    """Deform the ball of the first sensor's capture and draw the figure."""
    inputs, params = snakemake.input, snakemake.params
    recorded, fit = recordings_of(inputs, params.probes)[0], read_all(inputs.fits)[0]
    frame, tracked = fit["range"]["last_frame"], load_tracked(inputs.tracked[0])
    turn = tracked.camera_from_object[:3, :3]
    depth, measured = fit["samples"]["depth_m"][frame], recorded.forces_n[frame]

    def posed(force, *, turn_force):
        return pose_problem(
            recorded.solid, tracked, force, frame, depth, recorded.support,
            indenter_radius_m=recorded.indenter_radius_m,
            force_rule=params.force_rule, turn_force=turn_force, **params.solid,
        )  # fmt: skip

    normal = normal_at(posed(measured, turn_force=True).mesh, recorded, tracked)
    leaning = turn @ force_direction.tilted(measured @ turn, -(measured @ turn), TILT_DEG)
    problems = {
        "as measured": posed(measured, turn_force=False),
        "turned to the triangle's normal": posed(measured, turn_force=True),
        LEANING: posed(leaning, turn_force=False),
    }
    moduli = {"E": STUDY_E_PA, "nu": STUDY_NU}
    cases = [
        (name, force_direction.press(one, tracked.contact_point_m, normal=normal, **moduli))
        for name, one in problems.items()
    ]
    lean = problems[LEANING].measurement.force_n.sum(axis=0)
    # Seen across the way that the force leans.
    view = View(float(np.rad2deg(np.arctan2(lean[1], lean[0])) - 90), 8)
    note = (
        f"force {np.linalg.norm(measured):.1f} N, E {STUDY_E_PA / 1e3:.0f} kPa and nu"
        f" {STUDY_NU:.2f} of the study"
    )
    with style.journal():
        figure = force_direction.figure_5_12(
            params.captures[0], cases, view, times=TIMES, note=note
        )
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


def normal_at(mesh, recorded, tracked):
    """Outward normal of the contact triangle, object frame."""
    reach = recorded.indenter_radius_m
    point = tracked.contact_point_m
    return outward_normal(mesh, contact_triangle(mesh, point, largest_distance_m=reach))


run(main, snakemake)

"""Entries of Chapter 5 and Appendix A."""

from collections.abc import Callable, Mapping, Sequence
from types import SimpleNamespace

from palpate.workflow.run import BALL, EAR, Described, Run

from thesis import selections as select
from thesis.artefact import ACCURACY, Artefact, figure, table

MODULI = "thesis.chapter5.moduli_tables:make_moduli_table"
MINIMISATION = "thesis.chapter5.minimisation_figures:make_minimisation"
MISMATCH_VIEWS = "thesis.chapter5.mismatch_views:make_mismatch_views"
FITS_AT_ALL_POINTS = "thesis.chapter5.hertz_points:make_figure_a"
# Shown of a minimisation whose later iterations change nothing (Figure 5.9).
FIRST_ITERATIONS = 40
# Of the views that show the whole of an object from the side of the camera.
ELEVATION_DEG = {BALL: 20, EAR: None}


def _ball(run: Run) -> list[Described]:
    return run.first_tracked(BALL)


def _ear(run: Run) -> list[Described]:
    return run.first_tracked(EAR)


def _grid_inputs(run: Run, captures: Sequence[Described]) -> dict:
    """What shows the sample points in a picture and in the plan."""
    capture = SimpleNamespace(**captures[0])
    return {
        "object": run.raw(f"{capture.object}/object.yaml"),
        "template": run.template_of(capture),
        "alignment": run.files(captures, "alignment.json")[0],
        "recorded": run.recordings(captures)[0],
        "optics": run.optics_of(capture),
    }


def _hertz_fits(run: Run, captures: Sequence[Described]) -> dict:
    return {"fits": run.files(captures, "hertz.json")}


def _mismatches(run: Run, captures: Sequence[Described]) -> dict:
    """Mismatch of the first error option, and the surfaces that it was found on."""
    return {
        "mismatches": run.files(captures, f"mismatch-{run.errors[0]}.vtu"),
        "tracked": run.files(captures, f"tracked-{run.tracker}.npz"),
    }


def _study_surfaces(run: Run, captures: Sequence[Described]) -> dict:
    """What the study's tracker gets of captures, and what it makes of it."""
    tracked = {"tracked": run.files(captures, "tracked-study.npz")}
    return select.tracker_inputs(run, captures) | tracked


def _pictured(run: Run, captures: Sequence[Described]) -> dict:
    """The same with the pictures."""
    return _study_surfaces(run, captures) | {
        "recorded": run.recordings(captures),
        "optics": select.calibrations_of(run, captures),
    }


def _probes(run: Run, captures: Sequence[Described]) -> dict:
    return {"probes": select.probes_of(run, captures)}


def _options(run: Run, captures: Sequence[Described]) -> dict:
    return {"options": select.tracker_of(run, captures, "study")}


def _sensors(run: Run, captures: Sequence[Described]) -> dict:
    return {"sensors": select.sensors_of(run, captures)}


def _moduli(
    name: str,
    of: Callable[[Run], str],
    *,
    heading: str,
    published: str = "",
    captures: Callable | None = None,
    truth: bool = True,
    **known: str,
) -> Artefact:
    """E, nu and E* of an object from error minimisation, beside the printed table."""
    return Artefact(
        name,
        make=MODULI,
        outputs=table(name),
        captures=captures or (lambda run: select.all_tracked(run, of(run))),
        inputs=lambda run, captures: {
            "results": select.minima(run, captures),
            "material": select.material_of(run, of(run)) if truth else [],
            "published": run.published(published or name),
        },
        params=lambda run, captures: {"errors": run.errors, "name": of(run), "heading": heading},
        local=True,
        **known,
    )


def _minimisation(
    name: str, captures: Callable, *, iterations: int | None = None, **known: str
) -> Artefact:
    """Course of the minimisation of the first error option."""
    return Artefact(
        name,
        make=MINIMISATION,
        outputs=figure(name),
        captures=captures,
        inputs=lambda run, captures: {
            "results": select.minima(run, captures, run.errors[:1]),
        },
        params=lambda run, captures: {"error": run.errors[0], "iterations": iterations},
        **known,
    )


def _mismatch_views(name: str, of: str, **known: str) -> Artefact:
    """Mismatch on an object from two sides."""
    return Artefact(
        name,
        make=MISMATCH_VIEWS,
        outputs=figure(name),
        captures=lambda run: run.first_tracked(of),
        inputs=_mismatches,
        params=lambda run, captures: {"elevation_deg": ELEVATION_DEG[of]},
        **known,
    )


def _fits_at_all_points(name: str, sensor: str, **known: str) -> Artefact:
    """Hertz fits at all points of the block by one sensor."""
    return Artefact(
        name,
        caption="Force (N) against depth (mm) at the 18 points, with the fit of Eq. 5.1.",
        make=FITS_AT_ALL_POINTS,
        outputs=figure(name),
        captures=lambda run: select.over_the_block(run, sensor),
        inputs=_hertz_fits,
        **known,
    )


def _step_inputs(run: Run, captures: Sequence[Described]) -> dict:
    """What the error minimisation gets, of every tracker, and the truth."""
    trackers = select.steps_trackers(run)
    return {
        "object": run.raw("{object}/object.yaml"),
        "solid": run.results("{object}/solid.vtu"),
        "tracked": [run.of_capture(f"tracked-{name}.npz") for name in trackers],
        "force": run.of_capture("force.csv"),
        "fit": run.of_capture("hertz.json"),
        "truth": run.truth("{object}/{sensor}/{capture}/truth.npz"),
    }


def _step_params(run: Run, captures: Sequence[Described]) -> Mapping:
    return {
        "probe": run.probe_spec,
        "solid": run.config["solid"],
        "options": run.search_of,
        "steps": select.steps(run),
        "tracker": run.tracker,
        "trackers": select.steps_trackers(run),
        "errors": run.errors,
    }


HERTZ = (
    Artefact(
        "figure_5_1",
        title="Figure 5.1: grid of sample points",
        caption="The declared points on the block, in the picture and from above (cm). Published:"
        " the same grid of 3 x 6.",
        make="thesis.chapter5.hertz_maps:make_figure_5_1",
        outputs=figure("figure_5_1"),
        captures=lambda run: select.shown(run, "figure_5_1")[:1],
        inputs=_grid_inputs,
        params=lambda run, captures: {"sensor": select.sensors_of(run, captures)[0]},
        made=select.of_the_block,
    ),
    Artefact(
        "figure_5_2",
        title="Figure 5.2: Hertz model at one point",
        caption="Force (N) against depth (mm), the range used, and the fit of Eq. 5.1. The study"
        " shows point 8.",
        make="palpate.report.hertz_figures:make_hertz_fits",
        outputs=figure("figure_5_2"),
        captures=lambda run: select.shown(run, "figure_5_2"),
        inputs=_hertz_fits,
    ),
    Artefact(
        "table_5_1",
        title="Table 5.1: E* of repeated presses",
        caption="Reduced modulus (Pa) of 16 presses of point 11. Published: mean 30800 Pa, standard"
        " deviation 2700 Pa, as printed; computed from the 16 printed values they are 30844 and"
        " 2693 Pa.",
        make="thesis.chapter5.hertz_points:make_table_5_1",
        outputs=table("table_5_1"),
        captures=select.attempts,
        inputs=lambda run, captures: (
            _hertz_fits(run, captures) | {"published": run.published("table_5_1")}
        ),
        local=True,
    ),
    Artefact(
        "figure_5_3",
        title="Figure 5.3: repeated presses of one point",
        caption="Force (N) against depth (mm), aligned at 0.3 N; E* of each press beside the"
        " printed ones. Published: mean 30.8 kPa, standard deviation 2.7 kPa.",
        make="thesis.chapter5.hertz_points:make_figure_5_3",
        outputs=figure("figure_5_3"),
        captures=select.repeated,
        inputs=lambda run, captures: (
            _hertz_fits(run, captures) | {"published": run.published("table_5_1")}
        ),
    ),
    Artefact(
        "table_5_2",
        title="Table 5.2: E* over the block",
        caption="Reduced modulus (Pa) at the 18 points by sensor, by the study's fit and by the"
        " recommended contact model, the printed values beside it.",
        make="thesis.chapter5.hertz_points:make_table_5_2",
        outputs=table("table_5_2") | {"pattern": "tables/table_5_2_pattern.csv"},
        captures=lambda run: run.described(),
        inputs=lambda run, captures: (
            _hertz_fits(run, captures) | {"published": run.published("table_5_2")}
        ),
        params=lambda run, captures: {"block": select.block(run)},
        local=True,
    ),
    Artefact(
        "figure_5_4",
        title="Figure 5.4: reduced modulus over the block",
        caption="E* (kPa) of the Hertz fit at each point and sensor, the published map beside it.",
        make="thesis.chapter5.hertz_maps:make_figure_5_4",
        outputs=figure("figure_5_4"),
        captures=select.over_the_block,
        inputs=lambda run, captures: (
            _hertz_fits(run, captures) | {"published": run.published("table_5_2")}
        ),
        params=lambda run, captures: {"block": select.block(run)},
    ),
    _fits_at_all_points(
        "figure_a_1",
        "bumblebee",
        title="Figure A.1: Hertz fits at all points, Bumblebee2",
    ),
    _fits_at_all_points(
        "figure_a_2",
        "kinect",
        title="Figure A.2: Hertz fits at all points, Kinect",
    ),
)

BLOCK = (
    Artefact(
        "figure_5_5",
        title="Figure 5.5: tracking the block",
        caption="Picture, cloud with added points, and tracked surface, by sensor.",
        make="thesis.chapter5.tracked_surfaces:make_figure_5_5",
        outputs=figure("figure_5_5"),
        captures=lambda run: select.block_shown(run, "figure_5_5"),
        inputs=_pictured,
        params=lambda run, captures: (
            _probes(run, captures) | _sensors(run, captures) | _options(run, captures)
        ),
        made=select.draws_trackers,
    ),
    Artefact(
        "figure_5_6",
        title="Figure 5.6: rigid alignment that slides",
        caption="Without points that hold it, the cloud of a point at the block's end slides along"
        " the template (mm).",
        make="thesis.chapter5.rigid_slide:make_figure_5_6",
        outputs=figure("figure_5_6"),
        captures=select.at_the_end,
        inputs=lambda run, captures: (
            select.tracker_inputs(run, captures)
            | {
                "planes": [
                    run.results(f"{c['object']}/{c['sensor']}/support_plane.json") for c in captures
                ]
            }
        ),
        params=lambda run, captures: (
            _probes(run, captures) | {"options": run.config["tracking"]["alignment"]}
        ),
        made=select.draws_trackers,
    ),
    Artefact(
        "figure_5_7",
        title="Figure 5.7: tracking without refinement",
        caption="Side and top view: the dent (mm) with the template's own mesh, and refined at the"
        " contact. Published: wider and shallower without.",
        make="thesis.chapter5.tracked_surfaces:make_figure_5_7",
        outputs=figure("figure_5_7"),
        captures=lambda run: select.block_shown(run, "figure_5_7"),
        inputs=lambda run, captures: (
            _study_surfaces(run, captures)
            | {"unrefined": run.files(captures, "tracked-unrefined.npz")}
        ),
        params=_probes,
        made=select.draws_trackers,
    ),
    _minimisation(
        "figure_5_8",
        lambda run: select.shown(run, "figure_5_8"),
        title="Figure 5.8: error minimisation at point 16",
        caption="Lambda, mu (kPa) and error (mm) over all iterations, force and displacement error."
        " Published: no change after 40 iterations.",
    ),
    _minimisation(
        "figure_5_9",
        lambda run: select.shown(run, "figure_5_8"),
        iterations=FIRST_ITERATIONS,
        title="Figure 5.9: its first 40 iterations",
        caption="Lambda, mu (kPa) and error (mm) up to where Figure 5.8 no longer changes.",
        message="Figure 5.9: first iterations of Figure 5.8",
    ),
    Artefact(
        "figure_5_10",
        title="Figure 5.10: mismatch on the block",
        caption="Distance of every node between tracked and computed deformation (mm), by sensor.",
        make="thesis.chapter5.mismatch_views:make_figure_5_10",
        outputs=figure("figure_5_10"),
        captures=lambda run: select.shown(run, "figure_5_10"),
        inputs=_mismatches,
    ),
    _moduli(
        "table_5_3",
        select.block,
        captures=select.table_5_3_captures,
        truth=False,
        title="Table 5.3: E, nu and E* of the block",
        caption="Error minimisation at points 8, 16, 17 by error option and sensor, E and E* in Pa,"
        " the printed values beside it. The verdict says whether the data tell nu at all.",
        heading="Table 5.3: E (Pa), nu and E* (Pa) of the block from error minimisation",
    ),
    _moduli(
        "table_5_3_all",
        select.block,
        published="table_5_3",
        title="Table 5.3, whole: E, nu and E* of all points of the block",
        caption="Error minimisation at every tracked point by error option and sensor, E and E* in"
        " Pa, with Hertz's E* and the lab's truth (the instantaneous modulus) beside it. The study"
        " prints points 8, 16 and 17.",
        heading="Table 5.3 for all points: E (Pa), nu and E* (Pa) of the block",
    ),
)

BALL_AND_EAR = (
    Artefact(
        "figure_5_11",
        title="Figure 5.11: clouds of the ball",
        caption="Single view, turned undeformed cloud, turned deformed cloud (mm), by sensor.",
        make="thesis.chapter5.tracked_surfaces:make_figure_5_11",
        outputs=figure("figure_5_11"),
        captures=_ball,
        inputs=_study_surfaces,
        params=lambda run, captures: _probes(run, captures) | _options(run, captures),
        made=select.draws_trackers,
    ),
    Artefact(
        "figure_5_12",
        title="Figure 5.12: direction of the force on the ball",
        caption="Computed deformation (mm) with the force as measured and turned to the normal of"
        " the contact triangle (Section 5.2.2).",
        make="thesis.chapter5.force_direction:make_figure_5_12",
        outputs=figure("figure_5_12"),
        captures=_ball,
        inputs=_study_surfaces,
        params=lambda run, captures: (
            _probes(run, captures)
            | {"solid": run.config["solid"], "force_rule": run.config["minimise"]["force_rule"]}
        ),
        made=select.draws_trackers,
    ),
    Artefact(
        "figure_5_13",
        title="Figure 5.13: tracking the ball",
        caption="Tracked from a single view and from the turned clouds (mm). Published: squashed"
        " towards the data from a single view.",
        make="thesis.chapter5.tracked_surfaces:make_figure_5_13",
        outputs=figure("figure_5_13"),
        captures=_ball,
        inputs=lambda run, captures: {
            "alignment": run.files(captures, "alignment.json"),
            "fits": run.files(captures, "hertz.json"),
            "tracked": run.files(captures, "tracked-study.npz"),
            "single_view": run.files(captures, "tracked-single_view.npz"),
        },
        made=select.draws_trackers,
    ),
    _minimisation(
        "figure_5_14",
        _ball,
        title="Figure 5.14: error minimisation of the ball",
        caption="Lambda, mu (kPa) and error (mm) against iteration, force and displacement error."
        " Published: the mean error falls from 19 to about 6 mm.",
    ),
    _mismatch_views(
        "figure_5_15",
        BALL,
        title="Figure 5.15: mismatch on the ball",
        caption="Distance of every node between tracked and computed deformation (mm), by sensor."
        " Published: a few millimetres.",
    ),
    _moduli(
        "table_5_4",
        lambda run: BALL,
        title="Table 5.4: E and nu of the ball",
        caption="Error minimisation by error option and sensor, E in Pa. Published: 130 to 373 kPa,"
        " nu 0.29 to 0.50.",
        heading="Table 5.4: E (Pa) and nu of the ball from error minimisation",
    ),
    Artefact(
        "figure_5_16",
        title="Figure 5.16: tracking the ear",
        caption="Picture, cloud, tracked surface, and the same with its edges.",
        make="thesis.chapter5.tracked_surfaces:make_figure_5_16",
        outputs=figure("figure_5_16"),
        captures=_ear,
        inputs=_pictured,
        params=lambda run, captures: _probes(run, captures) | _sensors(run, captures),
        made=select.draws_trackers,
    ),
    _minimisation(
        "figure_5_17",
        _ear,
        title="Figure 5.17: error minimisation of the ear",
        caption="Lambda, mu (kPa) and error (mm) against iteration, force and displacement error."
        " Published: the mean error goes from 2.3 to 2.27 mm.",
    ),
    _mismatch_views(
        "figure_5_18",
        EAR,
        title="Figure 5.18: mismatch on the ear",
        caption="Distance of every node between tracked and computed deformation (mm).",
    ),
    _moduli(
        "table_5_5",
        lambda run: EAR,
        title="Table 5.5: E and nu of the ear",
        caption="Error minimisation by error option, E in Pa. Published: 99.0 and 111.0 kPa,"
        " nu 0.217 and 0.358.",
        heading="Table 5.5: E (Pa) and nu of the ear from error minimisation",
    ),
)

BEYOND_THE_STUDY = (
    Artefact(
        "tracked_surface",
        title="Tracked surface and its dent",
        caption="What the camera sees, the tracked surface (displacement, mm), and a section"
        " through the dent with the cloud.",
        make="palpate.report.surface_figures:make_tracked_surface",
        outputs=figure("tracked_surface"),
        captures=lambda run: select.shown(run, "tracked_surface"),
        inputs=lambda run, captures: {
            "tracked": run.files(captures, f"tracked-{run.tracker}.npz"),
            "clouds": run.files(captures, "clouds.npz"),
            "fits": run.files(captures, "hertz.json"),
            "recorded": run.recordings(captures),
        },
        params=_sensors,
        message="Tracked surfaces",
    ),
    Artefact(
        "poisson_profiles",
        title="What the data tell of nu",
        caption="Least error for each Poisson's ratio, by capture and error option: a flat valley"
        " does not tell nu. The study prints nu without an interval.",
        make="thesis.chapter5.profile_figure:make_poisson_profiles",
        outputs=figure("poisson_profiles"),
        captures=lambda run: run.described("minimised"),
        inputs=lambda run, captures: {"results": select.minima(run, captures)},
        params=lambda run, captures: {"errors": run.errors},
        message="Profile of the error over Poisson's ratio",
    ),
    Artefact(
        "direct_moduli",
        title="Direct estimates of E and nu",
        caption="E and nu straight from clouds and forces, with 95 % intervals: each capture, and"
        " all captures of an object and sensor together (the recommended estimate, filled). The"
        " true values are drawn where the lab made the captures; the study never knew its own.",
        make="palpate.report.moduli_figure:make_direct_moduli",
        outputs=figure("direct_moduli"),
        captures=lambda run: run.described("direct"),
        inputs=lambda run, captures: {
            "direct": run.files(captures, "direct.json"),
            "joint": run.joint_estimates(),
            "materials": run.materials(),
        },
        params=lambda run, captures: {"groups": run.groups()},
        made=lambda run: run.direct,
        message="Figure of the direct estimates",
    ),
    Artefact(
        "minimise_steps",
        title="Steps of the error minimisation of a capture",
        caption="",
        make="thesis.chapter5.minimise_steps:make_minimise_steps",
        outputs={"result": "{object}/{sensor}/{capture}/minimise_steps.json"},
        inputs=_step_inputs,
        params=_step_params,
        wanted=False,
        log_name="minimise_steps/{object}-{sensor}-{capture}",
        message="Steps of the error minimisation of {wildcards.object}, {wildcards.sensor},"
        " {wildcards.capture}",
    ),
    Artefact(
        "minimise_steps_table",
        title="The error minimisation, step by step",
        caption="E over the truth a second after a step of strain, and nu, of each simulated"
        " capture: as configured, then with one change more at each step (joined), with each change"
        " alone (crosses), and with one change more on the true surface (open), which is what a"
        " perfect tracker would leave. Pressure: Hertz's over the contact radius. Ten nodes:"
        " quadratic elements. Contact left out: displacements within 1.5 contact radii don't count."
        " Elastic tracker: its surfaces; nu found on them is mostly the tracker's prior, 0.3, which"
        " is also the block's own. Poisson's ratios at 0 and 0.499 lie on the search's bounds;"
        " the ball rocks on the few nodes that hold it.\n\nSimulated: the virtual lab's captures"
        " held against its own truth, which no estimate reads. Exists as a figure and as a table.",
        make="thesis.chapter5.steps_table:make_minimise_steps_table",
        outputs=table("minimise_steps") | figure("minimise_steps"),
        captures=select.stepped,
        inputs=lambda run, captures: {
            "results": run.files(captures, "minimise_steps.json"),
            "materials": run.materials(),
        },
        params=lambda run, captures: {"shown": run.errors[-1]},
        chapter=ACCURACY,
        message="What each step of the error minimisation changes",
    ),
)

ARTEFACTS = (*HERTZ, *BLOCK, *BALL_AND_EAR, *BEYOND_THE_STUDY)

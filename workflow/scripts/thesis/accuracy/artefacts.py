"""Entries of what the lab's truth says of results."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from palpate.workflow.run import Described, Run

from thesis import selections as select
from thesis.artefact import ACCURACY, Artefact, figure, table

TRUTH = (
    "\n\nSimulated: the virtual lab's captures held against its own truth, which no estimate reads."
)
# What the accuracy of every stage is measured on, of a capture.
STAGES = ("mask.npz", "probe_pose.csv", "force.csv", "clock.json", "clouds.npz")


def _pressed_points(run: Run) -> list[Described]:
    """A simulated capture of each point of an object that the lab solves by itself."""
    found: dict[tuple[str, str], Described] = {}
    for capture in run.described("direct", simulated=True):
        name, point = capture["object"], capture["point"]
        found.setdefault((name, run.lab_point(name, point)), capture)
    return list(found.values())


def _folder(wildcards: object, output: Any) -> str:
    """Folder of all results, from a table's."""
    return str(Path(output.csv).parents[1])


def _stage_results(run: Run, captures: Sequence[Described]) -> list[str]:
    names = [*STAGES, f"tracked-{run.tracker}.npz", "hertz.json", *run.minima]
    return [path for name in names for path in run.files(captures, name)]


def _compared(run: Run, captures: Sequence[Described], pattern: str) -> list[str]:
    return [
        run.results(pattern.format(tracker=tracker, **capture))
        for capture in captures
        for tracker in run.config["tracking"]["compared"]
    ]


def _scanned_by_lab(run: Run) -> list[str]:
    return sorted(set(run.lab_objects) & set(run.scanned))


def _first_truths(run: Run) -> list[str]:
    """Truth of one recording of each scanned object, for its undeformed surface."""
    first = {c.object: c for c in sorted(run.simulated, reverse=True)}
    captures = [vars(first[name]) for name in _scanned_by_lab(run)]
    return select.truths(run, captures)


def _pictured(run: Run) -> list[Described]:
    """The capture that stands for all."""
    return select.shown(run, "tracked_surface")[:1] if run.tracked else []


def _groups(run: Run, captures: Sequence[Described]) -> list[dict[str, str]]:
    """What is estimated of the object of a capture."""
    return [g for g in run.groups() if g["object"] == captures[0]["object"]]


ARTEFACTS = (
    Artefact(
        "overview",
        title="A press, its dent, and what it tells",
        caption="The frame, a section through the dent (mm), and E and nu of all captures of the"
        " object with each sensor, with 95 % intervals (dashed: the truth)." + TRUTH,
        make="thesis.accuracy.overview:make_overview",
        outputs=figure("overview"),
        captures=_pictured,
        inputs=lambda run, captures: {
            "tracked": run.files(captures, f"tracked-{run.tracker}.npz"),
            "clouds": run.files(captures, "clouds.npz"),
            "fits": run.files(captures, "hertz.json"),
            "recorded": run.recordings(captures),
            "joint": [
                run.results(f"{g['object']}/{g['sensor']}/direct.json")
                for g in _groups(run, captures)
            ],
            "materials": run.materials(),
        },
        params=lambda run, captures: {
            "sensors": [run.sensors[c["sensor"]] for c in captures],
            "groups": _groups(run, captures),
        },
        made=lambda run: any(c["object"] in run.made_materials for c in _pictured(run)),
        chapter=ACCURACY,
    ),
    Artefact(
        "accuracy",
        title="E and nu against the truth",
        caption="Every method's moduli beside the true ones, with 95 % intervals, verdicts, and the"
        " recommended row of each object and sensor." + TRUTH,
        make="thesis.accuracy.estimates:make_accuracy",
        outputs=table("accuracy")
        | {
            "summary": "tables/accuracy_summary.csv",
            "summary_md": "tables/accuracy_summary.md",
            "summary_page": "pages/accuracy_summary.html",
        },
        inputs=lambda run, captures: {
            "summary": run.results("summary.csv"),
            "materials": run.materials(),
        },
        made=lambda run: run.described("direct", simulated=True),
        chapter=ACCURACY,
        local=True,
        message="E and nu of all methods against the lab's truth",
    ),
    Artefact(
        "hertz_accuracy",
        title="Contact models",
        caption="E* of 18 contact models over the true one, and how many of their 95 % intervals"
        " cover it." + TRUTH,
        make="thesis.accuracy.hertz:make_hertz_accuracy",
        outputs=table("hertz_accuracy") | {"summary": "tables/hertz_accuracy_summary.csv"},
        captures=lambda run: run.described(simulated=True),
        inputs=lambda run, captures: {
            "fits": run.files(captures, "hertz.json"),
            "materials": run.materials(),
        },
        chapter=ACCURACY,
        local=True,
        message="Hertz models against the lab's truth",
    ),
    Artefact(
        "indentation_accuracy",
        title="Indentation tables against the lab's mechanics",
        caption="Force of the indentation table over that of the lab's own contact solution, at"
        " the true moduli, by depth." + TRUTH,
        make="thesis.accuracy.indentation:make_indentation_accuracy",
        outputs=table("indentation_accuracy"),
        captures=_pressed_points,
        inputs=lambda run, captures: {
            "tables": [
                run.results("{object}/indentation-{point}.npz".format(**c)) for c in captures
            ],
            "ladders": [
                run.truth(f"{c['object']}/contact-{run.lab_point(c['object'], c['point'])}.npz")
                for c in captures
            ],
            "materials": run.materials(),
        },
        chapter=ACCURACY,
        local=True,
        message="Indentation tables against the lab's contact solutions",
    ),
    Artefact(
        "pipeline_accuracy",
        title="Every stage of the pipeline",
        caption="Error of pose, force, mask, cloud, alignment and moduli of each tracked capture,"
        " with its unit." + TRUTH,
        make="thesis.accuracy.capture_table:make_pipeline_accuracy",
        outputs=table("pipeline_accuracy"),
        captures=select.simulated_tracked,
        inputs=lambda run, captures: {
            "truths": select.truths(run, captures),
            "materials": run.materials(),
            "results": _stage_results(run, captures),
        },
        params=lambda run, captures: {
            "errors": run.errors,
            "tracker": run.tracker,
            "results": _folder,
        },
        chapter=ACCURACY,
        message="Accuracy against the lab's truth",
    ),
    Artefact(
        "tracking_accuracy",
        title="Trackers against the truth",
        caption="Mean error of the displacement (mm) over all vertices and near the contact, for"
        " each tracker and for no tracking at all." + TRUTH,
        make="thesis.accuracy.tracking_table:make_tracking_accuracy",
        outputs=table("tracking_accuracy"),
        captures=select.simulated_tracked,
        inputs=lambda run, captures: {
            "truths": select.truths(run, captures),
            "tracked": _compared(
                run, captures, "{object}/{sensor}/{capture}/tracked-{tracker}.npz"
            ),
            "seconds": _compared(
                run, captures, "benchmarks/track/{object}-{sensor}-{capture}-{tracker}.tsv"
            ),
        },
        params=lambda run, captures: {"trackers": run.config["tracking"]["compared"]},
        chapter=ACCURACY,
        message="Accuracy of the trackers against the lab's truth",
    ),
    Artefact(
        "tracking_accuracy_figure",
        title="Trackers against the truth",
        caption="Mean error of the displacement (mm) over all vertices and near the contact, for"
        " each tracker and for no tracking at all." + TRUTH,
        make="thesis.accuracy.tracking_dots:make_tracking_accuracy_figure",
        outputs=figure("tracking_accuracy"),
        inputs=lambda run, captures: {"table": run.results("tables/tracking_accuracy.csv")},
        made=lambda run: select.simulated_tracked(run) and select.draws_trackers(run),
        chapter=ACCURACY,
        message="Accuracy of the trackers, drawn",
    ),
    Artefact(
        "sensor_accuracy",
        title="Recordings about the sensors",
        caption="Error of calibration, resting tip, CD case and loading test, with its unit."
        + TRUTH,
        make="thesis.accuracy.sensor_table:make_sensor_accuracy",
        outputs=table("sensor_accuracy"),
        inputs=lambda run, captures: {
            "found": [
                run.results(f"sensors/{sensor}/{select.READINGS[name]}")
                for sensor, name in select.read_experiments(run)
            ],
            "truths": [
                run.truth(f"sensors/{sensor}/{name}.npz")
                for sensor, name in select.read_experiments(run)
            ],
        },
        params=lambda run, captures: {
            "names": [sensor for sensor, _ in select.read_experiments(run)],
            "experiments": [name for _, name in select.read_experiments(run)],
            "sensors": run.sensors,
            "results": _folder,
        },
        made=lambda run: select.whole(run) and select.read_experiments(run),
        chapter=ACCURACY,
        message="Readings about the sensors against the lab's truth",
    ),
    Artefact(
        "plane_noise",
        title="Depth noise of a sensor on planes",
        caption="",
        make="thesis.accuracy.fidelity_table:make_plane_noise",
        outputs={"noise": "sensors/{sensor}/plane_noise.csv"},
        inputs=lambda run, captures: {"planes": run.raw("sensors/{sensor}/planes")},
        params=lambda run, captures: {
            "sensor": run.sensor_spec,
        },
        wanted=False,
        log_name="plane_noise/{sensor}",
        message="Depth noise of the {wildcards.sensor} on planes",
    ),
    Artefact(
        "lab_fidelity",
        title="The lab's errors beside real devices",
        caption="Depth noise on planes, scatter of the tip, noise of force and scanner, each beside"
        " what is published of real devices.\n\nSimulated recordings; reference values with their"
        " source. Exists as a figure and as a table.",
        make="thesis.accuracy.fidelity_table:make_lab_fidelity",
        outputs=table("lab_fidelity") | figure("lab_fidelity"),
        inputs=lambda run, captures: {
            "planes": select.sensor_files(run, "planes", "plane_noise.csv"),
            "workspaces": select.sensor_files(run, "workspace", "workspace.csv"),
            "holds": select.sensor_files(run, "loading", "loading.csv"),
            "templates": [run.results(f"{name}/template.ply") for name in _scanned_by_lab(run)],
            "truths": _first_truths(run),
            "published": run.published("table_4_2"),
        },
        params=lambda run, captures: {
            "sensors": run.sensors,
            "planes": run.sensors_of("planes"),
            "workspace": run.sensors_of("workspace"),
            "loading": run.sensors_of("loading"),
            "scanned": _scanned_by_lab(run),
        },
        made=lambda run: (
            select.lab_records(run)
            and all(run.sensors_of(name) for name in ("planes", "workspace", "loading"))
        ),
        chapter=ACCURACY,
        message="The lab's errors beside those of real devices",
    ),
)

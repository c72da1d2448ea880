"""Entries of Chapter 4 that recordings about the sensors are made into."""

from collections.abc import Callable, Sequence
from typing import Any

from palpate.workflow.run import Described, Run

from thesis import selections as select
from thesis.artefact import CHAPTERS, Artefact, figure, table


def _there(experiment: str) -> Callable[[Run], list[str]]:
    """Sensors of which a run shows an experiment."""
    return lambda run: select.experiments(run, experiment)


def _folders(run: Run, experiment: str) -> list[str]:
    return [run.raw(f"sensors/{sensor}/{experiment}") for sensor in run.sensors_of(experiment)]


def _readings(run: Run, experiment: str) -> dict:
    """Params of what shows an experiment of all sensors."""
    provenance = select.provenance(run, experiment)
    return {"names": run.sensors_of(experiment), "provenance": provenance}


def _sensor(run: Run) -> dict:
    """Params of what reads an experiment of one sensor."""
    return {
        "sensor": run.sensor_spec,
        "probe": lambda wildcards: select.probe_of_experiments(run),
    }


# Section 4.1.4: the optics of a sensor's cameras.


def _calibrated(run: Run) -> list[str]:
    """Sensors with a colour and an infrared camera that a run calibrates."""
    found = select.experiments(run, "calibration")
    return [sensor for sensor in found if "depth" in run.sensors[sensor]]


def _calibration(run: Run) -> dict:
    names = _calibrated(run)[:1]
    return {"calibration": [run.results(f"sensors/{name}/calibration.json") for name in names]}


def _pictures(run: Run, captures: Sequence[Described]) -> dict:
    return _calibration(run) | {
        "pairs": [run.raw(f"sensors/{sensor}/calibration") for sensor in _calibrated(run)[:1]]
    }


CALIBRATION = (
    Artefact(
        "table_4_1",
        title="Table 4.1: focal lengths and principal points",
        caption="Colour and infrared camera of the Kinect (px). Published: fx 522.6 and 584.6 px.",
        make="thesis.chapter4.calibration:make_table_4_1",
        outputs=table("table_4_1"),
        inputs=lambda run, captures: _calibration(run) | {"published": run.published("table_4_1")},
        made=_calibrated,
        local=True,
    ),
    Artefact(
        "equation_4_12",
        title="Equation 4.12: from the infrared to the colour camera",
        caption="Rotation and translation (m), the study's printed values beside ours. Published:"
        " t = -2.50, 0.01, 0.27 cm.",
        make="thesis.chapter4.calibration:make_equation_4_12",
        outputs=table("equation_4_12"),
        inputs=lambda run, captures: (
            _calibration(run) | {"published": run.published("equation_4_12")}
        ),
        made=_calibrated,
        chapter=CHAPTERS["4"],
        local=True,
    ),
    Artefact(
        "figure_4_9",
        title="Figure 4.9: a calibration pair with its corners",
        caption="Infrared and colour picture of the board, and the corners found in them."
        "\n\nSimulated captures where the picture says so.",
        make="thesis.chapter4.calibration:make_figure_4_9",
        outputs=figure("figure_4_9"),
        inputs=_pictures,
        made=_calibrated,
    ),
    Artefact(
        "figure_4_10",
        title="Figure 4.10: poses of the board",
        caption="Estimated places of the calibration board relative to both cameras (m)."
        "\n\nSimulated captures where the picture says so.",
        make="thesis.chapter4.calibration:make_figure_4_10",
        outputs=figure("figure_4_10"),
        inputs=_pictures,
        made=_calibrated,
    ),
)


# Section 4.2.3: scatter of the resting tip over the workspace.


def _points(run: Run) -> dict:
    return {"tables": select.sensor_files(run, "workspace", "workspace.csv")}


def _workspace_figure(name: str, *, title: str, caption: str) -> Artefact:
    return Artefact(
        name,
        title=title,
        caption=caption,
        make=f"thesis.chapter4.workspace_figures:make_{name}",
        outputs=figure(name),
        inputs=lambda run, captures: _points(run),
        params=lambda run, captures: _readings(run, "workspace"),
        made=_there("workspace"),
    )


WORKSPACE = (
    Artefact(
        "workspace_error",
        title="Error of the resting tip over the workspace",
        caption="",
        make="thesis.chapter4.workspace_error:make_workspace_error",
        outputs={"table": "sensors/{sensor}/workspace.csv"},
        inputs=lambda run, captures: {
            "workspace": run.raw("sensors/{sensor}/workspace"),
            "optics": run.optics_of,
        },
        params=lambda run, captures: _sensor(run),
        wanted=False,
        priority=10,
        log_name="workspace_error/{sensor}",
        message="Error of the resting tip over the workspace, {wildcards.sensor}",
    ),
    Artefact(
        "table_4_2",
        title="Table 4.2: scatter of the resting tip",
        caption="Mean standard deviation over the workspace by axis and sensor (cm) at the selected"
        " threshold. Published: 0.0048, 0.0016, 0.0165 cm (Bumblebee2) and 0.0033, 0.0012,"
        " 0.0168 cm (Kinect).",
        make="thesis.chapter4.workspace:make_table_4_2",
        outputs=table("table_4_2"),
        inputs=lambda run, captures: _points(run) | {"published": run.published("table_4_2")},
        params=lambda run, captures: _readings(run, "workspace") | {"sensors": run.sensors},
        made=_there("workspace"),
        local=True,
    ),
    _workspace_figure(
        "figure_4_14",
        title="Figure 4.14: the sampled workspace",
        caption="Resting places of the tip (cm) and the workspace.",
    ),
    _workspace_figure(
        "figure_4_15",
        title="Figure 4.15: scatter of the tip against the threshold",
        caption="Mean standard deviation of the resting tip in x, y, z (cm) against the threshold"
        " of the reprojection error (px). Published: selected 0.45 px.",
    ),
    _workspace_figure(
        "figure_4_16",
        title="Figure 4.16: scatter of the normal's angle",
        caption="Mean standard deviation of the angle of the marker's normal (degrees) against the"
        " threshold (px).",
    ),
    _workspace_figure(
        "figure_4_17",
        title="Figure 4.17: inliers against the threshold",
        caption="Mean number of corners kept against the threshold (px), per sensor.",
    ),
    _workspace_figure(
        "figure_4_18",
        title="Figure 4.18: reprojection error against the threshold",
        caption="Mean reprojection error (px) against the threshold (px), per sensor.",
    ),
    _workspace_figure(
        "figure_4_19",
        title="Figure 4.19: scatter of the tip against distance",
        caption="Standard deviation of the resting tip (cm) against the distance of the grid's"
        " point from the camera, by axis and sensor.",
    ),
)


# Force and displacement while loading and holding.
LOADING = (
    Artefact(
        "loading_test",
        title="Force and displacement while loading and holding",
        caption="",
        make="thesis.chapter4.loading_test:make_loading_test",
        outputs={
            "frames": "sensors/{sensor}/loading.csv",
            "force": "sensors/{sensor}/loading_force.csv",
        },
        inputs=lambda run, captures: {
            "loading": run.raw("sensors/{sensor}/loading"),
            "optics": run.optics_of,
        },
        params=lambda run, captures: (
            _sensor(run)
            | {
                "pose": run.config["probe_pose"],
                "options": run.config["force"],
                "inlier_distance_m": run.config["support_plane"]["inlier_distance_m"],
                "onset_force_n": run.config["hertz"]["onset_force_n"],
                "seed": run.config["seed"],
            }
        ),
        wanted=False,
        log_name="loading_test/{sensor}",
        message="Force and displacement while loading and holding, {wildcards.sensor}",
    ),
    Artefact(
        "figure_4_6",
        title="Figure 4.6: force and displacement against time",
        caption="Force (N) and depth of the tip (mm) while the block is loaded and then held, both"
        " sensors. Published: force relaxes while the displacement rests.",
        make="thesis.chapter4.probe_figures:make_figure_4_6",
        outputs=figure("figure_4_6"),
        inputs=lambda run, captures: {
            "frames": select.sensor_files(run, "loading", "loading.csv"),
            "forces": select.sensor_files(run, "loading", "loading_force.csv"),
        },
        params=lambda run, captures: _readings(run, "loading"),
        made=_there("loading"),
    ),
)


# Section 4.2.4: the tip around a CD case.


def _case_outputs() -> dict[str, str]:
    names = {"path": "cd_case_path.csv", "place": "cd_case.json", "cloud": "cd_case_cloud.npz"}
    return {key: f"sensors/{{sensor}}/{name}" for key, name in names.items()}


def _traced(run: Run) -> dict[str, Any]:
    return {
        "paths": select.sensor_files(run, "cd_case", "cd_case_path.csv"),
        "places": select.sensor_files(run, "cd_case", "cd_case.json"),
    }


def _case_figure(name: str, *, title: str, caption: str) -> Artefact:
    return Artefact(
        name,
        title=title,
        caption=caption,
        make=f"thesis.chapter4.probe_figures:make_{name}",
        outputs=figure(name),
        inputs=lambda run, captures: (
            _traced(run)
            | {
                "clouds": select.sensor_files(run, "cd_case", "cd_case_cloud.npz"),
                "cases": _folders(run, "cd_case"),
            }
        ),
        params=lambda run, captures: _readings(run, "cd_case") | {"sensors": run.sensors},
        made=_there("cd_case"),
    )


CASE = (
    Artefact(
        "cd_case",
        title="Tip around the CD case",
        caption="",
        make="thesis.chapter4.cd_case:make_cd_case",
        outputs=_case_outputs(),
        inputs=lambda run, captures: {
            "case": run.raw("sensors/{sensor}/cd_case"),
            "optics": run.optics_of,
        },
        params=lambda run, captures: (
            _sensor(run)
            | {
                "size_m": run.config["experiments"]["cd_case_size_m"],
                "pose": run.config["probe_pose"],
                "inlier_distance_m": run.config["support_plane"]["inlier_distance_m"],
                "seed": run.config["seed"],
            }
        ),
        wanted=False,
        log_name="cd_case/{sensor}",
        message="Tip around the CD case, {wildcards.sensor}",
    ),
    Artefact(
        "cd_case_table",
        title="Table, Section 4.2.4: tracing the CD case",
        caption="Distance of the tip's centre from the case's outline (mm): as measured, smoothed,"
        " and under the study's filter. The tip's radius is 6.22 mm.",
        make="thesis.chapter4.cd_case_table:make_cd_case_table",
        outputs=table("cd_case"),
        inputs=lambda run, captures: _traced(run),
        params=lambda run, captures: _readings(run, "cd_case"),
        made=_there("cd_case"),
        chapter=CHAPTERS["4"],
        local=True,
    ),
    _case_figure(
        "figure_4_13",
        title="Figure 4.13: the tip before and after the filter",
        caption="Part of the path around the CD case (mm): as measured, under the study's filter"
        " (Eq. 4.21) and under the smoother.",
    ),
    _case_figure(
        "figure_4_20",
        title="Figure 4.20: the CD case being traced",
        caption="One colour image of the recording.",
    ),
    _case_figure(
        "figure_4_21",
        title="Figure 4.21: traced path against the cloud",
        caption="Path of the tip and cloud of the case (mm), by sensor.",
    ),
)

EXPERIMENTS = (*CALIBRATION, *LOADING, *WORKSPACE, *CASE)

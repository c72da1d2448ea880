"""Entries of Chapter 4: diagrams and views of the rig, and what single captures show."""

from collections.abc import Callable, Sequence

from palpate.workflow.run import Described, Run

from thesis import selections as select
from thesis.artefact import Artefact, figure
from thesis.chapter4 import rig
from thesis.chapter4.experiment_artefacts import EXPERIMENTS


def _drawn_sensor(run: Run, name: str) -> dict:
    """Params of a diagram of a sensor's optics."""
    return {"sensor": run.sensors[name], "depth_m": rig.drawn_depth(run, name)}


def _of_block(name: str) -> Callable[[Run], list[Described]]:
    """First capture of the block that a diagram shows."""
    return lambda run: select.block_shown(run, name)[:1]


def _in_colour(run: Run) -> bool:
    """Whether the capture of Figure 4.11 has colours."""
    (capture,) = _of_block("figure_4_11")(run)
    return run.sensors[capture["sensor"]]["color"]["encoding"] != "mono8"


def _pixel_inputs(run: Run, captures: Sequence[Described]) -> dict:
    """Background and one capture, with its mask."""
    (recording,), (mask,) = run.recordings(captures), run.files(captures, "mask.npz")
    folder = "{object}/{sensor}".format(**captures[0])
    return {
        "model": run.results(f"{folder}/background.npz"),
        "mask": mask,
        "background": run.raw(f"{folder}/background"),
        "capture": recording,
    }


ARTEFACTS = (
    Artefact(
        "figure_4_1",
        title="Figure 4.1: the three depth devices",
        caption="Above the housings, sketched at about their size, each to its own scale, with the"
        " scanner's camera and slit; baselines are as configured. Below the fields of view and the"
        " scanner's places as configured, seen from above (m); fields of view are cut short. The"
        " study shows photographs.\n\nA view of the virtual rig.",
        make="thesis.chapter4.sensor_views:make_figure_4_1",
        outputs=figure("figure_4_1"),
        params=lambda run, captures: {"devices": rig.devices(run)},
        made=rig.devices,
    ),
    Artefact(
        "figure_4_2",
        title="Figure 4.2: triangulation of the Kinect",
        caption="Depth from disparity with the configured baseline (mm) and focal length (px),"
        " Eq. 4.1. A diagram.",
        make="thesis.chapter4.triangulation:make_figure_4_2",
        outputs=figure("figure_4_2"),
        params=lambda run, captures: _drawn_sensor(run, rig.dot_sensor(run)),
        made=rig.dot_sensor,
    ),
    Artefact(
        "figure_4_3",
        title="Figure 4.3: triangulation of the stereo head",
        caption="Depth from disparity with the configured baseline (mm) and focal length (px). A"
        " diagram.",
        make="thesis.chapter4.triangulation:make_figure_4_3",
        outputs=figure("figure_4_3"),
        params=lambda run, captures: _drawn_sensor(run, rig.of_kind(run, "stereo")),
        made=lambda run: rig.of_kind(run, "stereo"),
    ),
    Artefact(
        "figure_4_4",
        title="Figure 4.4: plane fitted to a vertex and its neighbours",
        caption="A piece of a captured cloud (mm), the plane of Eq. 4.4 to 4.6 and its normal.",
        make="thesis.chapter4.normal_figure:make_figure_4_4",
        outputs=figure("figure_4_4"),
        captures=lambda run: select.block_shown(run, "figure_5_5"),
        inputs=lambda run, captures: {
            "clouds": run.files(captures, "clouds.npz"),
            "alignments": run.files(captures, "alignment.json"),
        },
        params=lambda run, captures: {"neighbours": run.config["clouds"]["normal_neighbours"]},
    ),
    Artefact(
        "figure_4_5",
        title="Figure 4.5: force sensor, handle and indenter",
        caption="Indenter, board and their poses are the probe's configuration, the sensor's size"
        " its data sheet's (mm); handle, stem and the board's margin are sketched. The study shows"
        " a photograph.\n\nA view of the virtual rig.",
        make="thesis.chapter4.probe_view:make_figure_4_5",
        outputs=figure("figure_4_5"),
        params=lambda run, captures: {"probe": rig.drawn_probe(run)},
        made=lambda run: run.probes,
    ),
    Artefact(
        "figure_4_7",
        title="Figure 4.7: the capture setup",
        caption="Camera, object and probe at each sensor's configured places; the table's size, the"
        " handle and the housing are sketched, and fields of view end a little beyond the object."
        " The study shows photographs.\n\nA view of the virtual rig.",
        make="thesis.chapter4.rig_views:make_figure_4_7",
        outputs=figure("figure_4_7"),
        params=lambda run, captures: {"setups": rig.setups(run)},
        made=rig.setups,
    ),
    Artefact(
        "figure_4_8",
        title="Figure 4.8: pinhole camera model",
        caption="Projection of a point onto the image plane. A diagram, no data.",
        make="thesis.chapter4.pinhole_figure:make_figure_4_8",
        outputs=figure("figure_4_8"),
        params=lambda run, captures: _drawn_sensor(run, rig.pinhole_sensor(run)),
        made=rig.pinhole_sensor,
    ),
    Artefact(
        "figure_4_11",
        title="Figure 4.11: colour model of the background",
        caption="Brightness and colour distortion of one pixel, Eq. 4.13 to 4.19.",
        make="thesis.chapter4.colour_model:make_figure_4_11",
        outputs=figure("figure_4_11"),
        captures=_of_block("figure_4_11"),
        inputs=_pixel_inputs,
        params=lambda run, captures: {
            "sensor": run.sensors[captures[0]["sensor"]],
            "options": run.config["background"],
        },
        made=_in_colour,
    ),
    Artefact(
        "figure_4_12",
        title="Figure 4.12: from the tip to the camera",
        caption="The chain of transforms of Eq. 4.20, drawn for one frame (mm).",
        make="thesis.chapter4.transform_chain:make_figure_4_12",
        outputs=figure("figure_4_12"),
        captures=_of_block("figure_4_12"),
        inputs=lambda run, captures: {"pose": run.files(captures, "probe_pose.csv")[0]},
        params=lambda run, captures: {
            "sensor": run.sensors[captures[0]["sensor"]],
            "probe": run.probe_of(captures[0]["object"]),
        },
    ),
    *EXPERIMENTS,
)

"""Entries of Chapter 3."""

from palpate.workflow.run import Described, Run

from thesis import selections as select
from thesis.artefact import CHAPTERS, Artefact, figure, table

CHAPTER = CHAPTERS["3"]
DATA = ("exact", "tracked")
FIGURES = "thesis.chapter3.simulation_figures"
VIEWS = "thesis.chapter3.simulation_views"
BLOCK = "thesis.chapter3.block"


def _steps(run: Run, captures: list[Described]) -> dict:
    return {"steps": select.simulated_steps(run)}


def _steps_and_truth(run: Run, captures: list[Described]) -> dict:
    return _steps(run, captures) | {"truth": select.simulation_truth(run)}


def _steps_and_tracked(run: Run, captures: list[Described]) -> dict:
    tracked = run.results("simulation/tracked.npz")
    of_data = lambda wildcards: tracked if wildcards.data == "tracked" else []  # noqa: E731
    return _steps(run, captures) | {"tracked": of_data}


def _trace(
    name: str, title: str, caption: str, make: str, *, result: str, method: str, data: str
) -> Artefact:
    """Figure of a method's way to the block's moduli."""
    return Artefact(
        name,
        title=title,
        caption=caption,
        make=f"{FIGURES}:{make}",
        outputs=figure(name),
        inputs=lambda run, captures: {
            "result": run.results(f"simulation/{result}.json"),
            "published": run.published("simulation"),
            "truth": select.simulation_truth(run),
        },
        params=lambda run, captures: {"method": method, "data": data},
        made=select.has_simulation,
    )


def _first_of_block(run: Run) -> list[Described]:
    """First capture that Figure 3.3 shows, where the study's block was captured."""
    return select.shown(run, "figure_3_3")[:1] if select.block_captured(run) else []


ARTEFACTS = (
    Artefact(
        "figure_3_1",
        title="Figure 3.1: mechanical quantities and their laws",
        caption="Force, stress, strain and displacement, and the laws that tie them: equilibrium,"
        " constitutive, kinematic. A diagram, no data.",
        make="thesis.chapter3.mechanics:make_figure_3_1",
        outputs=figure("figure_3_1"),
    ),
    Artefact(
        "figure_3_2",
        title="Figure 3.2: stress on an infinitesimal cube",
        caption="The nine components of the stress on the three planes (Pa). A diagram, no data.",
        make="thesis.chapter3.mechanics:make_figure_3_2",
        outputs=figure("figure_3_2"),
    ),
    Artefact(
        "table_3_1",
        title="Table 3.1: boundary values by set of nodes",
        caption="What is known of displacement and force at contact, free surface, support and"
        " interior, with the number of nodes in the block's mesh.",
        make="thesis.chapter3.simulation_tables:make_table_3_1",
        outputs=table("table_3_1"),
        captures=_first_of_block,
        inputs=lambda run, captures: {
            "object": run.raw(f"{captures[0]['object']}/object.yaml"),
            "solid": run.results(f"{captures[0]['object']}/solid.vtu"),
        },
        params=lambda run, captures: {
            "probe": run.probe_of(captures[0]["object"]),
            "solid": run.config["solid"],
        },
    ),
    Artefact(
        "figure_3_3",
        title="Figure 3.3: contact triangle and contact area",
        caption="The triangle that takes the measured force, its neighbours and the indenter's"
        " circle (mm) on the block's refined template (Eq. 3.27).",
        make="thesis.chapter3.contact_figure:make_figure_3_3",
        outputs=figure("figure_3_3"),
        captures=_first_of_block,
        inputs=lambda run, captures: {
            "solid": run.results(f"{captures[0]['object']}/solid.vtu"),
            "tracked": run.files(captures, f"tracked-{run.tracker}.npz")[0],
            "fit": run.files(captures, "hertz.json")[0],
        },
        params=lambda run, captures: {"solid": run.config["solid"]},
    ),
    Artefact(
        "figure_3_4",
        title="Figure 3.4: displacement of the simulated block",
        caption="Magnitude of the displacement (mm) under the traction of the last of 24 steps. The"
        " study shows the same for its own simulation (Figure 3.4, in metres).\n\nSimulated data.",
        make=f"{VIEWS}:make_figure_3_4",
        outputs=figure("figure_3_4"),
        inputs=_steps,
        made=select.has_simulation,
    ),
    _trace(
        "figure_3_5",
        "Figure 3.5: linear method on exact data",
        "Lame's lambda and mu (Pa) and the residual against iteration (Algorithm 1). Published:"
        " lambda 80685, mu 8965, residual down to 1e-4.\n\nSimulated data.",
        "make_linear_traces",
        result="linear-exact",
        method="linear_method",
        data="exact",
    ),
    _trace(
        "figure_3_6",
        "Figure 3.6: linear method from five starts",
        "Lambda, mu (Pa) and residual from five unlike starting values. Published: the same end"
        " from every start.\n\nSimulated data, exact displacements.",
        "make_linear_starts",
        result="linear-exact",
        method="linear_method",
        data="exact",
    ),
    _trace(
        "figure_3_7",
        "Figure 3.7: linear method on tracked data",
        "Lambda, mu (Pa) and residual when the displacements come from surface tracking."
        " Published: lambda -21504, mu 21757, not physical.\n\nSimulated data, tracked.",
        "make_linear_traces",
        result="linear-tracked",
        method="linear_method",
        data="tracked",
    ),
    Artefact(
        "figure_3_8",
        title="Figure 3.8: moves of the Nelder-Mead simplex",
        caption="Reflection, expansion, contraction and shrinkage (Algorithm 2), and steps down the"
        " error of the simulated block.\n\nSimulated data.",
        make="thesis.chapter3.simplex:make_figure_3_8",
        outputs=figure("figure_3_8"),
        inputs=_steps,
        made=lambda run: run.lab is not None and "simulated_block" in run.lab,
    ),
    _trace(
        "figure_3_9",
        "Figure 3.9: displacement error minimisation on tracked data",
        "Lambda, mu (Pa) and mean error (mm) against iteration. Published: lambda 85252, mu 9472;"
        " truth lambda 80685, mu 8965.\n\nSimulated data, tracked.",
        "make_minimisation_trace",
        result="minimise-tracked-displacement",
        method="minimise_displacement",
        data="tracked",
    ),
    Artefact(
        "figure_3_10",
        title="Figure 3.10: mismatch on the simulated block",
        caption="Distance of every node between tracked and computed deformation (mm). Published:"
        " some mismatch on one contact node.\n\nSimulated data, tracked.",
        make=f"{VIEWS}:make_figure_3_10",
        outputs=figure("figure_3_10"),
        inputs=lambda run, captures: (
            _steps(run, captures)
            | {"mismatch": run.results("simulation/mismatch-tracked-displacement.vtu")}
        ),
        made=select.has_simulation,
    ),
    Artefact(
        "simulation_table",
        title="Table, Sections 3.3.2 to 3.3.4: moduli of the simulated block",
        caption="Lambda, mu, E (Pa) and nu by both methods, from exact and tracked displacements,"
        " beside the truth and the study's printed values.",
        make=f"{BLOCK}:make_simulation_table",
        outputs=table("simulation"),
        inputs=lambda run, captures: {
            "linear": [run.results(f"simulation/linear-{data}.json") for data in DATA],
            "minima": [
                run.results(f"simulation/minimise-{data}-{error}.json")
                for data in DATA
                for error in run.errors
            ],
            "published": run.published("simulation"),
            "truth": select.simulation_truth(run),
        },
        params=lambda run, captures: {"data": DATA},
        made=select.has_simulation,
        chapter=CHAPTER,
        local=True,
        message="Table of the simulated block's moduli",
    ),
    Artefact(
        "simulation_tracking",
        title="Table, Section 3.3.4: what the estimates owe to the tracker",
        caption="Errors of the tracker (m) under several options, and the moduli (Pa) that follow"
        " from them.",
        make=f"{BLOCK}:make_simulation_tracking",
        outputs=table("simulation_tracking"),
        inputs=_steps_and_truth,
        params=lambda run, captures: {
            "options": select.simulation_options(
                run, "support", "cuts", "corners", "tracking", "variants", "linear"
            ),
            "search": run.search,
        },
        made=select.has_simulation,
        chapter=CHAPTER,
        message="Simulated block: what the estimates owe to the tracker",
    ),
    Artefact(
        "simulation_noise",
        title="Section 3.3: moduli against noise",
        caption="Lambda and mu (Pa) from exact displacements with noise of 1 micrometre to 1 mm,"
        " median and range over five draws. The study shows one case, that of Figure 3.7."
        "\n\nSimulated data. Exists as a figure and as a table.",
        make=f"{BLOCK}:make_simulation_noise",
        outputs=table("simulation_noise") | figure("simulation_noise"),
        inputs=_steps_and_truth,
        params=lambda run, captures: {
            "options": select.simulation_options(run, "support", "linear", "noise"),
            "search": run.search,
            "seed": run.config["seed"],
        },
        made=select.has_simulation,
        chapter=CHAPTER,
        message="Simulated block: what noise does to the estimates",
    ),
    Artefact(
        "simulation_tracked",
        title="Tracking the simulated block",
        caption="",
        make=f"{BLOCK}:make_simulation_tracked",
        outputs={"tracked": "simulation/tracked.npz"},
        inputs=_steps,
        params=lambda run, captures: {
            "options": select.simulation_options(run, "cuts", "corners", "tracking")
        },
        made=select.has_simulation,
        wanted=False,
    ),
    Artefact(
        "linear_method",
        title="Linear method on the simulated block",
        caption="",
        make=f"{BLOCK}:make_linear_method",
        outputs={"result": "simulation/linear-{data}.json"},
        inputs=_steps_and_tracked,
        params=lambda run, captures: {
            "options": select.simulation_options(run, "support", "linear"),
            "data": lambda wildcards: wildcards.data,
        },
        made=select.has_simulation,
        wanted=False,
        wildcards={"data": "|".join(DATA)},
        log_name="linear_method/{data}",
        message="Linear method on the simulated block ({wildcards.data} data)",
    ),
    Artefact(
        "simulation_minimise",
        title="Error minimisation on the simulated block",
        caption="",
        make=f"{BLOCK}:make_simulation_minimise",
        outputs={
            "result": "simulation/minimise-{data}-{error}.json",
            "mismatch": "simulation/mismatch-{data}-{error}.vtu",
        },
        inputs=_steps_and_tracked,
        params=lambda run, captures: {
            "support": run.config["simulation"]["support"],
            "options": run.search,
            "data": lambda wildcards: wildcards.data,
            "error": lambda wildcards: wildcards.error,
        },
        made=select.has_simulation,
        wanted=False,
        wildcards={"data": "|".join(DATA)},
        log_name="simulation_minimise/{data}-{error}",
        message="Error minimisation ({wildcards.error}) on the simulated block"
        " ({wildcards.data} data)",
    ),
)

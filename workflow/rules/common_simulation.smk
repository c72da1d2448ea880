# What the rules of the simulated block (Section 3.3) share.
SIMULATED_DATA = ["exact", "tracked"]
SIMULATED_STEPS = f"{RAW}/simulations/foam_block.npz"
SIMULATION_FIGURES = ["3_4", "3_5", "3_6", "3_7", "3_9", "3_10"]


def simulation_options(*names):
    """Some of the simulation's options, so that the others re-run nothing."""
    return {name: config["simulation"][name] for name in names}


def lab_simulates():
    """Whether the lab makes the simulated block in this run."""
    return SIMULATED_STEPS in lab_experiments()


def simulation_tracked(wildcards):
    """The tracker's result where a rule works on tracked data."""
    return results("simulation/tracked.npz") if wildcards.data == "tracked" else []


def simulation_truth():
    """True moduli of the simulated block, where the lab makes it."""
    return truth("simulations/foam_block.json") if lab_simulates() else []


def simulation_minima():
    """Error minimisation on the simulated block, by data and error option."""
    return [
        results(f"simulation/minimise-{data}-{error}.json")
        for data in SIMULATED_DATA
        for error in ERRORS
    ]


def block_outputs():
    """Table 3.1 and Figure 3.3, where the study's block was captured."""
    if config["study"]["block"] not in {capture.object for capture in HOUSE.captures}:
        return []
    return [results("tables/table_3_1.csv"), results("figures/figure_3_3.png")]


def simulation_outputs():
    """Tables and figures of Chapter 3."""
    there = lab_simulates() or Path(SIMULATED_STEPS).exists()
    if config["only"] is not None or not there:
        return block_outputs()
    tables = ["simulation", "simulation_tracking", "simulation_noise"]
    figures = [f"figure_{number}" for number in SIMULATION_FIGURES] + [
        "simulation_noise"
    ]
    return [
        *block_outputs(),
        *(results(f"tables/{name}.csv") for name in tables),
        *(results(f"figures/{name}.png") for name in figures),
    ]

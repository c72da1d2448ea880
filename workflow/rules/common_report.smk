# What the report holds: each shown file has its caption, workflow/report/<file's stem>.rst.
import re

CAPTIONS = Path(workflow.basedir) / "workflow" / "report"
CHAPTERS = {
    "1": "1 The system",
    "3": "3 Models and simulation",
    "4": "4 Seeing",
    "5": "5 Experiments",
    "a": "A Appendix",
}
# What the study has not got; other names come under the chapter in their own name.
KINDS = {
    "comparison": "Beside the study",
    "accuracy": "Accuracy of the simulated captures",
    "beyond": "Beyond the study",
    "own": "Other objects",
    "run": "This run",
}
KIND_OF = {
    "comparison": KINDS["comparison"],
    "findings": KINDS["comparison"],
    "cd_case": CHAPTERS["4"],
    "equation_4_12": CHAPTERS["4"],
    "simulation": CHAPTERS["3"],
    "simulation_noise": CHAPTERS["3"],
    "simulation_tracking": CHAPTERS["3"],
    "table_5_3_all": CHAPTERS["5"],
    "accuracy": KINDS["accuracy"],
    "accuracy_summary": KINDS["accuracy"],
    "hertz_accuracy": KINDS["accuracy"],
    "lab_fidelity": KINDS["accuracy"],
    "minimise_steps": KINDS["accuracy"],
    "pipeline_accuracy": KINDS["accuracy"],
    "sensor_accuracy": KINDS["accuracy"],
    "tracking_accuracy": KINDS["accuracy"],
    "moduli": KINDS["own"],
    "hertz_fit": KINDS["own"],
    "surface": KINDS["own"],
    "configuration": KINDS["run"],
    "summary": KINDS["run"],
}
# Browsers sort results by name, letter for letter; a hair's breadth sorts before digits.
HAIR_SPACE = "\u200a"


def chapter_of(name):
    """Category of a file in the report."""
    parts = name.split("_")
    if parts[0] in ("figure", "table") and len(parts) == 3:
        return CHAPTERS[parts[1]]
    return KIND_OF.get(name, KINDS["beyond"])


def title_of(file, caption):
    """First line of a file's caption, so that Figure 5.2 comes before Figure 5.10.

    A figure and a table may share a caption that is numbered in neither; the title tells which.
    """
    title = caption.read_text(encoding="utf-8").splitlines()[0]
    if (
        title.startswith(("Figure", "Table", "Equation"))
        or chapter_of(caption.stem) == KINDS["run"]
    ):
        return re.sub(r"^(\w+ \w\.)(\d:)", rf"\1{HAIR_SPACE}\2", title)
    if chapter_of(caption.stem) == KINDS["own"]:
        return f"{{object}}: {title}"
    return f"{title} ({'figure' if file.endswith('.png') else 'table'})"


def captioned(files):
    """Put a file, or several, into the report, under its chapter and with its caption."""
    if not isinstance(files, str):
        return [captioned(file) for file in files]
    name = Path(files).stem
    caption = CAPTIONS / f"{name}.rst"
    if not caption.is_file():
        raise WorkflowError(f"workflow/report/{name}.rst: file: expected a caption")
    return report(
        files,
        caption=str(caption),
        category=chapter_of(name),
        labels={"Result": title_of(files, caption)},
    )


def tables_among(outputs):
    """Names of the tables that a run writes."""
    return [Path(path).stem for path in outputs if "/tables/" in path]


def objects_shown():
    """Tracked captures that the page of objects shows: one per object and sensor."""
    block = config["study"]["block"]
    others = sorted({c.object for c in HOUSE.tracked} - {block})
    mine = block_shown("tracked_surface")
    return [*mine, *(capture for name in others for capture in tracked_of(name))]


def with_report(outputs):
    """Outputs of the run and, made from them, what the report shows beside them."""
    pages = [f"{RESULTS}/pages/{name}.html" for name in tables_among(outputs)]
    pages += [f"{RESULTS}/pages/{name}.html" for name in ("summary", "configuration")]
    objects = [f"{RESULTS}/objects.html"] if HOUSE.tracked else []
    # The list of all these, for the run's last lines (house/closing.py).
    return [*outputs, *pages, *objects, f"{RESULTS}/wanted.txt"]

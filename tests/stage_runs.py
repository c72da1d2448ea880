"""One way to run a stage's script in this process, as Snakemake would."""

import runpy
from pathlib import Path
from types import SimpleNamespace

STAGES = Path(__file__).resolve().parents[1] / "workflow/scripts/stages"


class Named(list):
    """Values by place and by name, as Snakemake's own lists are."""

    def __init__(self, **values):
        super().__init__(values.values())
        self.__dict__ |= values

    def get(self, name, default=None):
        return self.__dict__.get(name, default)

    def keys(self):
        return self.__dict__.keys()


def stage_runner(folder, capfd):
    """Give what runs a stage: None where it ends well, else the one line that it ends with."""

    def run(script, *, inputs, outputs, params=None, wildcards=None):
        files = {n: str(path) if isinstance(path, Path) else path for n, path in inputs.items()}
        job = SimpleNamespace(
            rule=script,
            wildcards=Named(**wildcards or {}),
            log=folder / "log.txt",
            input=Named(**{name: file or [] for name, file in files.items()}),
            output=Named(**{name: str(folder / file) for name, file in outputs.items()}),
            params=Named(**params or {}),
        )
        try:
            runpy.run_path(str(STAGES / f"{script}.py"), init_globals={"snakemake": job})
        except SystemExit as end:
            assert end.code == 1
        shown = capfd.readouterr()
        assert shown.out == ""
        written = [(folder / file).exists() for file in outputs.values()]
        if not shown.err:
            assert all(written)
            return None
        assert not any(written)
        (line,) = shown.err.splitlines()
        assert line.startswith(f"error: {script}") and line in (folder / "log.txt").read_text()
        return line

    return run

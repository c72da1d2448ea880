"""Indentation tables of declared points, kept where a run keeps its own."""

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate import solid
from palpate.capture.devices import CONFIG
from palpate.commands.project import Project
from palpate.direct import SAME_RADIUS
from palpate.solid.fill import object_solid
from palpate.solid.indentation_table import IndentationModel, load_indentation, save_indentation
from palpate.solid.load_steps import point_table
from palpate.solid.options import IndentationTable
from palpate.solid.support import Support
from palpate.surface.template import Template


@dataclass(frozen=True)
class TablePoint:
    """What the indentation table of a point is made of."""

    folder: Path  # raw/<object>
    declared: Mapping  # object.yaml
    path: Path  # the template's file
    template: Template
    support: Support
    name: str  # of the point
    radius_m: float  # of the sphere [m]
    model: IndentationTable

    def table(
        self,
        project: Project,
        stage: Callable,
        *,
        changed: bool = False,
        own: Path | None = None,
    ) -> IndentationModel:
        """The table that is kept, or one made now, and kept.

        ``stage`` says what goes on; ``changed``: with other options than a run's; ``own`` is a
        folder of tables in place of results/<object>.
        """
        model, title = self.model, self.declared["object"]
        kept, folder = project.solid(title), own or project.results(title)
        mine = folder and folder / self._file(model, kept)
        of_run = folder and folder / f"indentation-{self.name}.npz"
        usable = bool(own) or (not changed and self._is_new(of_run, project))
        for path in [of_run, mine] if usable else [mine]:
            if path and path.is_file():
                table = load_indentation(path)
                if np.isclose(table.radius_m, self.radius_m, rtol=SAME_RADIUS):
                    with stage(f"indentation table of point {self.name}: {os.path.relpath(path)}"):
                        return table
        where = f", kept in {os.path.relpath(mine)}" if mine else ""
        surface = self.template.vertices_m, self.template.faces
        point, deepest_m = self.declared["points"][self.name], self.declared.get("deepest_m")
        size = {"radius_m": self.radius_m, "deepest_m": deepest_m}
        with stage(f"indentation table of point {self.name}: made now, a minute or more{where}"):
            mesh, _ = object_solid(*surface, self.declared["template"], self.support, kept=kept)
            table = point_table(mesh, self.support, surface, point, model, **size)
        if mine:
            save_indentation(mine, table)
        return table

    def _is_new(self, table: Path | None, project: Project) -> bool:
        """Whether a run would keep its table: what it is made of is older."""
        if table is None or not table.is_file():
            return False
        sources = [self.folder / "object.yaml", self.path, project.folder / CONFIG, *_code()]
        return all(table.stat().st_mtime >= source.stat().st_mtime for source in sources)

    def _file(self, model: IndentationTable, kept: Path | None) -> str:
        """Name of a table that says all that it is made of, the code too."""
        of_object = {name: self.declared.get(name) for name in ("template", "support", "deepest_m")}
        point = self.declared["points"][self.name]
        made_of = [of_object, point, self.radius_m, model.written()]
        digest = hashlib.sha256(json.dumps(made_of, sort_keys=True).encode())
        for path in filter(None, (self.path, kept, *_code())):
            digest.update(path.read_bytes())
        return f"indentation-{self.name}-{digest.hexdigest()[:8]}.npz"


def _code() -> list[Path]:
    """Modules that make a table."""
    return sorted(Path(solid.__file__).parent.glob("*.py"))

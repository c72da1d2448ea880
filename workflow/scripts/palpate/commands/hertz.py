"""The command ``palpate hertz``: E* of curves."""

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from palpate.units import KILOPASCALS


def _hertz(options: argparse.Namespace) -> None:
    """E* of a curve."""
    from palpate import hertz

    thickness = None if options.thickness_mm is None else options.thickness_mm / 1e3
    found = hertz.fit(
        *hertz.read_curve(options.curve),
        radius_m=options.radius_mm / 1e3,
        thickness_m=thickness,
        poisson_ratio=options.nu,
    )
    if options.json:
        print(json.dumps(asdict(found), indent=2))
        return
    low, high = (KILOPASCALS * end for end in found.reduced_modulus_interval_pa)
    print(f"E* {KILOPASCALS * found.reduced_modulus_pa:.4g} kPa (95 %: {low:.4g} to {high:.4g})")
    print(f"E {KILOPASCALS * found.youngs_modulus_pa(options.nu):.4g} kPa for nu {options.nu:g}")
    print(f"contact at {1e3 * found.contact_m:.3f} mm; {found.indenter}, {found.support}")


def add(commands: Any) -> None:
    """Add the command to a parser's."""
    hertz = commands.add_parser("hertz", help="fit E* to a curve of force against depth")
    hertz.add_argument("curve", type=Path, help="CSV with depth_m and force_n")
    hertz.add_argument("--radius-mm", type=float, required=True, help="of the sphere")
    hertz.add_argument("--thickness-mm", type=float, help="of a layer on a rigid base")
    hertz.add_argument("--nu", type=float, default=0.33, help="Poisson's ratio assumed (0.33)")
    hertz.add_argument("--json", action="store_true", help="for programs")
    hertz.set_defaults(work=_hertz)

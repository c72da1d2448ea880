"""Direct estimate of E and nu from one or more captures of an object with one sensor."""

import json
from dataclasses import asdict

import numpy as np
from palpate.capture.files import whole_file
from palpate.estimate.direct.estimate import estimate_direct
from palpate.run.direct_inputs import read_presses
from palpate.run.job import naming, run


def main(snakemake):
    """Write direct.json."""
    params = snakemake.params
    presses = read_presses(snakemake.input, params)
    radius = params.probe["indenter"]["radius_m"]
    with naming(", ".join(snakemake.input.poses), "frames"):
        found = estimate_direct(presses, params.options, radius_m=radius, seed=params.seed)
    with whole_file(snakemake.output.estimate) as part:
        text = json.dumps(described(found, presses, params), indent=2)
        part.write_text(text + "\n", encoding="utf-8")


def described(found, presses, params):
    """What direct.json says of an estimate."""
    best, first = found.solution, found.solution.parameters[0]
    moduli = {name: asdict(interval) for name, interval in found.moduli.items()}
    return {
        "captures": list(params.captures),
        "frames": [len(press.frames) for press in presses],
        "frames_beyond_lookup": [press.frames_beyond for press in presses],
        "law": best.law,
        "criterion": found.criterion,
        **moduli,
        "relaxation": {
            "times_s": list(params.options["relaxation_times_s"]),
            "fractions": first.fractions.tolist(),
        },
        "gain": first.gain,
        "nuisances": [nuisances(p) for p in best.parameters],
        "residuals": [summed(*of) for of in zip(presses, best.scales, strict=True)],
        "laws": [asdict(law) for law in found.laws],
        "profile": asdict(found.profile),
        "choices": {
            name: {"youngs_modulus_pa": E, "poisson_ratio": nu}
            for name, (E, nu) in found.choices.items()
        },
    }


def nuisances(p):
    """What a capture has for itself."""
    sunk, *rocked = p.settled.tolist()
    return {
        "offset_m": p.offset_m,
        "clock_s": p.clock_s,
        "shift_m": p.shift_m,
        "sunk_m": sunk,
        "rocked_rad": rocked,
    }


def summed(press, scales):
    """How a capture's residuals compare with what was stated."""
    return {
        "cells": int(press.seen.any(axis=0).sum()),
        "patches": len(np.unique(press.patch[press.seen.any(axis=0)])),
        "motion_std_m": float(np.median(press.moved_std_m[press.seen])) * scales.motion,
        "motion_scale": scales.motion,
        "motion_sharing": scales.sharing,
        "depth_std_m": press.depth_std_m * scales.depth,
        "depth_scale": scales.depth,
        "largest_depth_m": float(press.depth_m.max()),
    }


run(main, snakemake)

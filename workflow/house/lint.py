"""Run ``snakemake --lint`` and pass over the one rule that does not fit this workflow.

Snakemake asks every rule for a conda environment or a container. Here one environment, pinned with
hashes in ``environment.lock``, serves all rules, and the Makefile installs it.
"""

import json
import subprocess
import sys

PASSED_OVER = "Specify a conda environment or container for each rule."


def findings(report: dict) -> list[str]:
    """List what remains of a JSON lint report, a line for each finding."""
    lines = [_line("Snakefile", lint) for entry in report["snakefiles"] for lint in entry["lints"]]
    for entry in report["rules"]:
        place = f"rule {entry['for']['rule']}"
        lines += [_line(place, lint) for lint in entry["lints"] if lint["title"] != PASSED_OVER]
    return lines


def _line(place: str, lint: dict) -> str:
    return f"{place}: {lint['title']}"


def main() -> int:
    """Lint the workflow; the exit status is 1 when anything remains."""
    command = [sys.executable, "-m", "snakemake", "--lint", "json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    try:
        lines = findings(json.loads(done.stdout))
    except json.JSONDecodeError:
        lines = [(done.stderr or done.stdout).strip()]
    print("\n".join(lines) if lines else "snakemake --lint: nothing to mend")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())

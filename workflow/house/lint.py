"""Run ``snakemake --lint`` and pass over the one rule that does not fit this workflow.

Snakemake asks every rule for a conda environment or a container. Here one environment, pinned with
hashes in ``environment.lock``, serves all rules, and the Makefile installs it.
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "workflow"))

from house.safety import unsafe_workflow  # noqa: E402

PASSED_OVER = "Specify a conda environment or container for each rule."
PLACE = re.compile(r"^Lints for (.*):$")
FINDING = re.compile(r"^ {4}\* (.*?):?$")


def findings(report: str) -> list[str]:
    """List what remains of a lint report, a line for each finding."""
    lines, place = [], ""
    for line in report.splitlines():
        if found := PLACE.match(line):
            place = found.group(1)
        elif (found := FINDING.match(line)) and found.group(1) != PASSED_OVER:
            lines.append(f"{place}: {found.group(1)}")
    return lines


def main() -> int:
    """Lint the workflow; the exit status is 1 when anything remains or no report came.

    Code that could run what a capture holds counts as well.
    """
    # Of profiles Snakemake says that it uses them, before all else.
    command = [sys.executable, "-m", "snakemake", "--lint", "--workflow-profile", "none"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if not PLACE.search(done.stderr.strip().splitlines()[0]) and done.returncode:
        print(done.stderr.strip())
        return 1
    lines = findings(done.stderr) + unsafe_workflow(ROOT)
    print("\n".join(lines) or "snakemake --lint and safety: nothing to mend")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())

"""Speed and memory of all parts, beside physics engines.

Times are processor times, which other work on the machine disturbs little; compare the ratios
of one run. The figures are also written to runs/bench/bench.json.
"""

import json
import os
import platform
from pathlib import Path

from controllers import measure_controllers
from diagnosis import measure_diagnosis
from engines import measure_engines
from estimators import measure_estimators
from identification import measure_identification
from kernel import measure_compilation, measure_kernel
from recordings import measure_recordings

RESULTS = Path("runs/bench/bench.json")


def main() -> None:
    """Measure, print and write."""
    machine = {"processor": processor_name(), "cores": os.cpu_count(), "python": platform.python_version()}
    print(f"{machine['processor']}, {machine['cores']} cores, Python {machine['python']}")
    figures = {
        "machine": machine,
        "kernel": measure_kernel(),
        "engines": measure_engines(),
        "compilation": measure_compilation(),
        "identification": measure_identification(),
        "diagnosis": measure_diagnosis(),
        "estimators": measure_estimators(),
        "controllers": measure_controllers(),
        "recordings": measure_recordings(),
    }
    RESULTS.parent.mkdir(parents=True, exist_ok=True)
    RESULTS.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
    print(f"\nwritten to {RESULTS}")


def processor_name() -> str:
    """Model of the processor, as far as the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


if __name__ == "__main__":
    main()

"""Measure memory and speed of a long simulated session, its clock running free.

Speed is the time that the session would last in reality, and that of its takes alone,
over the processor time of everything: simulation, raw files, checks, pair verdicts
and data set.

Bar: memory does not grow over 500 pairs; 20 times real time.
"""

import os
import resource
import shutil
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from capture.operator.display import PlainDisplay
from capture.plan import build_plan
from capture.session.folder import SessionFolder
from capture.session.journal import Event
from capture.session.run import run_session
from capture.session.start import SessionRequest, plan_session
from harness import make_parser, write_results


class Meter(PlainDisplay):
    """Note the memory in use as takes are finished."""

    def __init__(self, console: Console) -> None:
        super().__init__(console, simulated=True)
        self.megabytes: list[float] = []

    def show(self, event: Event) -> None:
        """Look at the memory after each take."""
        super().show(event)
        if event["event"] == "take_finished":
            self.megabytes.append(resident_megabytes())


def resident_megabytes() -> float:
    """Return the memory of this process that is in use now."""
    statm = Path("/proc/self/statm")
    if not statm.exists():
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    pages = int(statm.read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def main(argv: Sequence[str] | None = None) -> int:
    """Run the session, print the table, write the result."""
    parser = make_parser(__doc__, "long_session", "4 pairs")
    parser.add_argument("--pairs", type=int, default=500)
    options = parser.parse_args(argv)
    pairs = 4 if options.quick else options.pairs
    settings = {"simulation": {"noise_db": -60.0, "placement_mm": 3.0}}
    config = plan_session(SessionRequest("kitchen", str(pairs), settings=settings))
    place = Path(tempfile.mkdtemp())
    try:
        with Path(os.devnull).open("w") as nowhere:
            meter = Meter(Console(file=nowhere))
            begun = time.process_time()
            path = run_session(SessionFolder(place / "long"), config, meter)
            cpu = time.process_time() - begun
        size = path.stat().st_size / 2**20
    finally:
        shutil.rmtree(place)
    plan = build_plan(config)
    takes = sum(step.takes for step in plan.measures)
    early = meter.megabytes[: max(1, takes // 10)]
    late = meter.megabytes[-max(1, takes // 10) :]
    result = {
        "takes": takes,
        "cpu_s": cpu,
        "cpu_per_take_s": cpu / takes,
        "session_speed": plan.seconds() / cpu,
        "takes_speed": takes * plan.take_s / cpu,
        "early_mb": max(early),
        "late_mb": max(late),
        "growth_mb": max(late) - max(early),
        "dataset_mb": size,
    }
    write_results(options.out, result)
    for name, value in result.items():
        print(f"{name:18s} {value:10.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

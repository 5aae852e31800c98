"""Measure the peak memory of one training step of AVR at the reference size.

2050 rays x 64 shells x 1600 samples, batch 4, networks 128 and 512 wide, with the
sinusoids and with the hash grid; each step runs in a process of its own, whose
largest resident size (Python and torch included) is told in GB of 10^9 bytes.

Bar: less than 8 GB.
"""

import json
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from harness import make_parser, write_results

BATCH = 4
N_SAMPLES = 1600
LIMIT_GB = 8.0
ENCODINGS = {"sinusoids": {"octaves": 10}, "hash grid": {"hash_levels": 20}}


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "renderer_memory", "few rays, one encoding")
    parser.add_argument("--rays", type=int, default=2050)
    parser.add_argument("--encoding", help="measure this one, in this process")
    options = parser.parse_args(argv)
    rays = 32 if options.quick else options.rays
    if options.encoding:
        print(json.dumps(measure(rays, options.encoding)))
        return 0
    names = list(ENCODINGS)[: 1 if options.quick else None]
    found = {name: _in_a_process(rays, name) for name in names}
    print(f"{'encoding':12s} {'peak GB':>8s} {'CPU s':>7s}   ({rays} rays)")
    for name, one in found.items():
        print(f"{name:12s} {one['peak_gb']:8.2f} {one['seconds']:7.1f}")
    write_results(options.out, {"rays": rays, "steps": found})
    return int(any(one["peak_gb"] > LIMIT_GB for one in found.values()))


def _in_a_process(rays: int, encoding: str) -> dict[str, float]:
    command = [sys.executable, __file__, "--rays", str(rays), "--encoding", encoding]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


def measure(rays: int, encoding: str) -> dict[str, float]:
    """Take one step; returns peak_gb and its CPU seconds."""
    import torch

    from fields.data import prepare
    from fields.models.avr import PRESETS, Avr
    from fields.plan import TrainingPlan
    from fields.training.loop import Trainer
    from rir import Dataset

    torch.set_num_threads(1)
    rng = np.random.default_rng(0)
    ends = rng.uniform([-2.5, -2, 0.5], [2.5, 2, 2.5], (2, BATCH, 3))
    decay = 10 ** (-3 * np.arange(N_SAMPLES) / 4000)
    responses = rng.standard_normal((BATCH, N_SAMPLES)) * decay
    data = prepare(Dataset.from_arrays(responses, *ends, sample_rate=16000))
    settings: dict[str, Any] = {"hash_levels": 0, **ENCODINGS[encoding]}
    config = {**vars(PRESETS["paper"]), **settings, "rays": rays, "far": 6.0}
    network = Avr(data.frame, type(PRESETS["paper"])(**config))
    started = time.process_time()
    Trainer(network, data, TrainingPlan(steps=1, batch_size=BATCH)).run()
    # Linux counts in kilobytes of 1024 bytes.
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return {"peak_gb": peak / 1e9, "seconds": time.process_time() - started}


if __name__ == "__main__":
    raise SystemExit(main())

"""Measure how well frame, repeatability and places are found from noisy readings.

Bar: the frame to 0.3 mm rms from touches with 0.5 mm of noise; sigma to 10 %.
"""

import itertools
import sys
from collections.abc import Sequence

import numpy as np

from harness import make_parser, write_results
from rigs.calibration.frame import Frame, fit_frame
from rigs.calibration.repeatability import COUNT, judge_approaches
from rigs.calibration.survey import refine_places

NOISE = 0.5e-3
REACH = (-2000.0, -2000.0, -1500.0)
"""Travel of the axes, mm; its corners are the points touched."""


def frame_error(points: int, rng: np.random.Generator) -> float:
    """Return the rms error over the reach of a frame fitted to noisy points, m."""
    quaternion = rng.normal(size=4)
    frame = Frame(rng.uniform(-3, 3, 3), quaternion / np.linalg.norm(quaternion))
    corners = np.array(list(itertools.product(*[(low, 0.0) for low in REACH])))
    touched = np.resize(corners[[0, 3, 5, 6, 1, 2, 4, 7]], (points, 3))
    surveyed = frame.to_room(touched) + rng.normal(0, NOISE, (points, 3))
    fit = fit_frame(touched, surveyed)
    places = rng.uniform(REACH, 0, (200, 3))
    off = fit.frame.to_room(places) - frame.to_room(places)
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "rig_calibration")
    options = parser.parse_args(argv)
    rng = np.random.default_rng(0)
    trials = 50 if options.quick else 2000
    report: dict[str, object] = {}
    for points in (3, 4, 8, 12, 16, 24):
        errors = np.array([frame_error(points, rng) for _ in range(trials)])
        rms = float(np.sqrt(np.mean(errors**2)))
        high = float(np.quantile(errors, 0.95))
        print(
            f"frame, {points:2d} points, 0.5 mm noise: {1e3 * rms:.3f} mm rms over the "
            f"reach, 95 % below {1e3 * high:.3f} mm"
        )
        report[f"frame_{points}"] = [rms, high]
    sigma = np.array(
        [
            judge_approaches(rng.normal(0, 1, COUNT), rng.normal(3, 1, COUNT)).sigma
            for _ in range(trials)
        ]
    )
    within = float(np.mean(np.abs(sigma - 1) < 0.1))
    print(
        f"repeatability from {COUNT} approaches a side: sigma within 10 % in "
        f"{100 * within:.1f} % of tests"
    )
    report["sigma_within_10_percent"] = within
    true = rng.uniform(0, [4, 3, 2], (40, 3))
    i, j = np.triu_indices(40, 1)
    lengths = np.linalg.norm(true[i] - true[j], axis=1) + rng.normal(0, 1e-3, len(i))
    guess = true + rng.normal(0, 5e-3, true.shape)
    survey = refine_places(guess, np.stack([i, j], 1), lengths)
    before, after = (float(np.std(p - true)) for p in (guess, survey.places))
    print(f"acoustic survey: places from {1e3 * before:.2f} to {1e3 * after:.2f} mm")
    report["survey_m"] = [before, after]
    write_results(options.out, report)
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Simulate an L-shaped room, ask why, and exchange the ends.

Everything printed here is SIMULATED.
"""

import numpy as np

from rir import GainPattern, Pose
from rooms import Scene, plan_effects, simulate

OUTLINE = [(0, 0), (6, 0), (6, 2.5), (3, 2.5), (3, 5), (0, 5)]
MATERIALS = {"floor": "wood_floor", "all": "furnished_wall"}


def main() -> None:
    """Print the plan, the estimated error, and the effect of exchanging the ends."""
    cardioid = GainPattern.cardioid()
    scene = Scene.extruded(OUTLINE, 3.0, MATERIALS, emitter_gain=cardioid)
    swapped = Scene.extruded(OUTLINE, 3.0, MATERIALS, listener_gain=cardioid)

    plan = plan_effects(scene, sample_rate=16000, duration=0.3)
    for name, verdict in plan.verdicts.items():
        print(f"{name:12s} {'on ' if verdict.on else 'off'} {verdict.reason}")

    here, there = Pose.at(1, 4, 1.2, yaw_deg=-60), Pose.at(5, 1, 1.4)
    options = {"sample_rate": 16000, "duration": 0.3, "rays": 2000}
    forward = simulate(scene, here, there, **options)
    print("standard error of C50:", round(forward.errors["clarity_db"], 3), "dB")

    unfair = simulate(scene, there, here, **options).responses
    fair = simulate(swapped, there, here, **options).responses
    size = np.linalg.norm(forward.responses)
    for what, other in (("places only", unfair), ("places and patterns", fair)):
        change = np.linalg.norm(other - forward.responses) / size
        print(f"exchanging {what}: {20 * np.log10(change + 1e-30):.0f} dB")


if __name__ == "__main__":
    main()

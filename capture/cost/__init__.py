"""What accuracy costs in a session: error against seconds, knob by knob.

Played in the session's own simulated room, because only there the truth is known.
"""

from capture.cost.measure import measure_session
from capture.cost.trials import CostTrial, imperfect, trials_of

__all__ = ["CostTrial", "imperfect", "measure_session", "trials_of"]

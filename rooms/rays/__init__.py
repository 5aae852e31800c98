"""Ray tracing of energy: what no single path describes."""

from rooms.rays.energy import EnergyHistogram, trace_energy

__all__ = ["EnergyHistogram", "trace_energy"]

"""The paper's six metrics, one file each, in one visible table."""

from analysis.metrics.amplitude import AMPLITUDE
from analysis.metrics.clarity import CLARITY
from analysis.metrics.early_decay import EARLY_DECAY
from analysis.metrics.envelope import ENVELOPE
from analysis.metrics.metric import Flavour, Metric
from analysis.metrics.reverberation import REVERBERATION
from analysis.metrics.spectrogram import SPECTROGRAM
from rir.registry import Registry

__all__ = ["METRICS", "Flavour", "Metric"]

METRICS: Registry[Metric] = Registry("metric", "resounding.metrics", Metric)
for _metric in (AMPLITUDE, CLARITY, EARLY_DECAY, ENVELOPE, REVERBERATION, SPECTROGRAM):
    METRICS.add(_metric.symbol)(_metric)

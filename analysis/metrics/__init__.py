"""The paper's six metrics, one file each, in one visible table."""

from analysis.metrics import (
    amplitude,
    clarity,
    early_decay,
    envelope,
    reverberation,
    spectrogram,
)
from analysis.metrics.metric import Flavour, Metric
from analysis.metrics.table import METRICS

__all__ = ["METRICS", "Flavour", "Metric"]

_ENTERED = (amplitude, envelope, reverberation, clarity, early_decay, spectrogram)

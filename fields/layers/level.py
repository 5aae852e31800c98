"""The energy a trained field lacks, given back once at the end."""

from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from fields.data import FieldData
from fields.layers.query import Query

__all__ = ["Level"]

FRAME_S = 0.005  # of one gain: short against any decay time
ROWS = 256  # rows the gain is fitted to, evenly taken: a mean of levels needs no more
BATCH = 32  # rows rendered in one go: bounds memory, not the result
LARGEST = 4.0  # 12 dB: what a loss takes of a tail; more would be noise raised
SILENT = 1e-7  # 70 dB below the response: no frame below tells a level
FEWEST_ROWS = 4  # rows that must be heard in a frame for a mean of their levels


class Level(nn.Module):
    """Multiply responses by one gain over time, 1 until it is fitted.

    Losses on waveforms make what cannot be predicted quiet, most of all late in
    the response; a listener hears that as a drier room.

    Parameters
    ----------
    n_samples : int
        Length of a response.
    sample_rate : float
        Hz.
    """

    def __init__(self, n_samples: int, sample_rate: float) -> None:
        super().__init__()
        self.frame = max(round(FRAME_S * sample_rate), 1)
        self.register_buffer("gain", torch.ones(n_samples))

    gain: Tensor

    def forward(self, responses: Tensor) -> Tensor:
        """Return responses of shape (batch, n_samples) at their level."""
        return responses * self.gain

    @torch.no_grad()
    def fit(self, network: Any, data: FieldData) -> None:
        """Compare the mean level of frames with that of the data, in decibels."""
        self.gain.fill_(1.0)
        rows = np.linspace(0, len(data) - 1, min(len(data), ROWS)).astype(int)
        some = data.rows(rows)
        query = Query.of(some.emitters, some.listeners, self.gain.device)
        truth = torch.as_tensor(np.array(some.responses)).to(self.gain.device)
        answers = torch.cat(
            [
                network.render(query[start : start + BATCH]).float()
                for start in range(0, len(rows), BATCH)
            ]
        )
        ours, theirs = self._energies(answers), self._energies(truth)
        silent = SILENT * theirs.sum(-1, keepdim=True) + 1e-20
        logs = ((theirs + silent) / (ours + silent)).log()
        # Before the direct sound hardly anything stands against nothing at all,
        # and would make the direct sound of nearer places louder.
        heard = self._heard(query, data)
        rows_heard = heard.sum(0)
        ratio = (logs * heard).sum(0) / rows_heard.clamp_min(1.0)
        ratio = torch.where(rows_heard >= FEWEST_ROWS, ratio, 0.0)
        gains = torch.exp(0.5 * ratio).clamp(1 / LARGEST, LARGEST)
        if bool(torch.isfinite(gains).all()):
            self.gain.copy_(_between(gains, len(self.gain)))

    def _heard(self, query: Query, data: FieldData) -> Tensor:
        """Mark the frames of each row from its direct sound on, as 1.0 or 0.0."""
        pace = data.frame.sample_rate / data.frame.speed_of_sound
        arrivals = query.distance * pace
        frames = -(-len(self.gain) // self.frame)
        ends = (torch.arange(frames, device=arrivals.device) + 1) * self.frame
        return (ends > arrivals[:, None]).float()

    def _energies(self, responses: Tensor) -> Tensor:
        short = -responses.shape[-1] % self.frame
        padded = nn.functional.pad(responses, (0, short))
        return padded.unflatten(-1, (-1, self.frame)).square().sum(-1)


def _between(gains: Tensor, count: int) -> Tensor:
    wide = nn.functional.interpolate(
        gains[None, None], count, mode="linear", align_corners=False
    )
    return wide[0, 0]

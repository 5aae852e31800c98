"""How good a session was, from what it logged of itself."""

import numpy as np

from analysis.likeness.room import noise_levels
from analysis.reciprocity import RoomDistances
from analysis.report.contents import SessionQuality, Span
from rir.dataset import Dataset

__all__ = ["session_quality"]

_NOT_QUALITY = {
    "pair_id",
    "take_no",
    "channel",
    "emitter_id",
    "listener_id",
    "accepted",
}


def session_quality(dataset: Dataset, room: RoomDistances) -> SessionQuality:
    """Return takes, noise, and the range of every number the session logged.

    Parameters
    ----------
    dataset : Dataset
        Where the room's rows are.
    room : RoomDistances
        The room.
    """
    sessions = {pair.session for pair in room.pairs}
    rows = np.flatnonzero(np.isin(np.asarray(dataset.table["session"]), list(sessions)))
    used = np.concatenate([np.r_[p.forward, p.reverse] for p in room.pairs])
    accepted = np.asarray(dataset.table["accepted"], bool)[rows]
    noise = np.concatenate(
        [
            noise_levels(
                np.asarray(dataset.responses[part], float), dataset.sample_rate
            )
            for part in np.array_split(used, max(1, len(used) // 64))
        ]
    )
    return SessionQuality(
        sessions=sorted(sessions),
        takes=len(rows),
        takes_rejected=int(np.sum(~accepted)),
        takes_used=len(used),
        sample_rate_hz=dataset.sample_rate,
        duration_s=dataset.n_samples / dataset.sample_rate,
        noise_floor_db=_span(noise),
        logged=_logged(dataset, rows),
    )


def _logged(dataset: Dataset, rows: np.ndarray) -> dict[str, Span]:
    logged = {}
    for name, column in dataset.table.items():
        values = np.asarray(column)[rows]
        if name in _NOT_QUALITY or values.dtype.kind != "f":
            continue
        numbers = values.astype(float)
        if np.isfinite(numbers).any():
            logged[name] = _span(numbers)
    return logged


def _span(values: np.ndarray) -> Span:
    kept = values[np.isfinite(values)]
    if not len(kept):
        return Span(np.nan, np.nan, np.nan)
    return Span(float(kept.min()), float(np.median(kept)), float(kept.max()))

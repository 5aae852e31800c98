"""A trained network beside another field, used where it proved right.

Where no geometry explains a room, a network may know more of it than interpolated rows
do. It is trained without some emitter places and compared with the other field there;
both are then mixed octave by octave and 5 ms by 5 ms, or the network is left out.
Both orders of the ends ask it the same question, so that its answers do not change
when emitter and listener are exchanged.
"""

import io
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fields.data import FieldData
from fields.plan import TrainingPlan
from fields.table import FIELDS
from inverse.acoustics import Acoustics
from inverse.blend.fallback import NearestRows
from inverse.blend.mixture import mix, mixing_weights
from inverse.rows.fitset import FitSet, place_numbers
from inverse.rows.proof import beaten_by_nearest, prove
from inverse.rows.tiles import Tiles
from rir import Poses
from rir.arrays import FloatArray
from rir.errors import MissingPartError
from rir.optional import require

__all__ = [
    "FieldWithNetwork",
    "SymmetricNetwork",
    "held_out_rows",
    "join_network",
    "train_network",
]

EVERY = 3
"""Every third place is held out: enough to compare on, and two thirds to learn from."""
BATCH_ROWS = 32
"""Rows a training step: small, so that a few hundred steps see varied rows."""
MOST_GAIN = 2.0
"""Tiles are amplified by 6 dB at most: more would make noise of a faint waveform."""
LEAST_SHARE = 1e-2
"""Where both weights sum to less, neither waveform was right (40 dB down)."""
MOST_LOG_ENERGY = 6.0
"""Log energy ratios are kept within e^±6, 26 dB: enough to reach the largest gain."""
UNKNOWN_MISFIT = 1e3
"""Mean square misfit of a tile that no row tells: as bad as 140 dB off."""


@dataclass(frozen=True, eq=False)
class SymmetricNetwork:
    """Answer from a trained network, the same both ways."""

    field: Any
    """The trained network."""
    alike: bool
    """Whether the devices have one pattern, so that ends may be exchanged."""

    def predict(self, emitters: Poses, listeners: Poses, n_samples: int) -> FloatArray:
        """Return responses, shape (queries, n_samples), a direct sound 1/distance."""
        if self.alike:
            emitters, listeners = _ordered(emitters, listeners)
        # One by one: rows of a batch may round differently in another batch.
        rows = [
            self.field.predict(emitters[k : k + 1], listeners[k : k + 1])
            for k in range(len(emitters))
        ]
        answers = np.concatenate(rows).astype(np.float64) / self.field.frame.scale
        return answers[:, :n_samples]

    def as_bytes(self) -> NDArray[np.uint8]:
        """Return the network's file as numbers."""
        import torch

        held = io.BytesIO()
        torch.save(self.field.stored(), held)
        return np.frombuffer(held.getvalue(), dtype=np.uint8)

    @classmethod
    def from_bytes(cls, stored: NDArray[np.uint8], alike: bool) -> "SymmetricNetwork":
        """Rebuild what :meth:`as_bytes` returned."""
        inras = FIELDS["inras"].load_module()

        held: Any = io.BytesIO(stored.tobytes())
        return cls(inras.load(held), alike)


def _ordered(first: Poses, second: Poses) -> tuple[Poses, Poses]:
    """Return both ends, the one with the smaller coordinates first."""
    gap = first.positions - second.positions
    axis = np.argmax(gap != 0, axis=1)
    turned = np.take_along_axis(gap, axis[:, None], axis=1)[:, 0] > 0
    pick = turned[:, None]
    ends = []
    for one, other in ((first, second), (second, first)):
        places = np.where(pick, other.positions, one.positions)
        turns = np.where(pick, other.orientations, one.orientations)
        ends.append(Poses(places, turns))
    return ends[0], ends[1]


@dataclass(frozen=True, eq=False)
class FieldWithNetwork:
    """Hold a network and its weight beside another field."""

    network: SymmetricNetwork
    """The network."""
    weights: FloatArray
    """Amplitudes of the other field's and of the network's waveforms. Shape (2, bands,
    bins)."""
    shares: FloatArray
    """How much of the energy, in decibels, is the network's. Shape (bands, bins)."""
    tiles: Tiles
    """Octaves and bins."""
    alone: bool = False
    """Whether the network answers alone."""

    @classmethod
    def fit(
        cls,
        network: SymmetricNetwork,
        measured: FloatArray,
        other: FloatArray,
        own: FloatArray,
    ) -> "FieldWithNetwork":
        """Weigh the other field's and the network's own answers to held-out rows.

        Parameters
        ----------
        network : SymmetricNetwork
            The network.
        measured, other, own : ndarray, shape (rows, n_samples)
            The truth and both predictions, none fitted to these rows.
        """
        tiles = Tiles(float(network.field.frame.sample_rate), measured.shape[1])
        weights = mixing_weights(measured, [other, own], tiles)
        truth = tiles.energies(measured)
        misfits = [_misfit(truth, tiles.energies(one)) for one in (other, own)]
        total = np.maximum(misfits[0] + misfits[1], 1e-300)
        return cls(network, weights, misfits[0] / total, tiles)

    def as_arrays(self) -> dict[str, np.ndarray]:
        """Return everything as plain arrays, for a file."""
        return {
            "network": self.network.as_bytes(),
            "alike": np.array(self.network.alike),
            "weights": self.weights,
            "shares": self.shares,
            "alone": np.array(self.alone),
        }

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray]) -> "FieldWithNetwork":
        """Rebuild what :meth:`as_arrays` returned."""
        network = SymmetricNetwork.from_bytes(arrays["network"], bool(arrays["alike"]))
        frame = network.field.frame
        tiles = Tiles(float(frame.sample_rate), int(frame.n_samples))
        parts = arrays["weights"], arrays["shares"]
        return cls(network, *parts, tiles, bool(arrays["alone"]))

    def apply(
        self, answer: FloatArray, emitters: Poses, listeners: Poses
    ) -> FloatArray:
        """Return the other field's answer completed, shape (rows, n_samples)."""
        own = self.network.predict(emitters, listeners, answer.shape[1])
        return own if self.alone else self.mixed(answer, own)

    def mixed(self, other: FloatArray, own: FloatArray) -> FloatArray:
        """Return the sum of two answers, its energies between theirs in decibels."""
        tiles = self.tiles
        both = mix(tiles, self.weights, [other, own])
        # Where neither waveform was right their sum is empty: take the other field's.
        empty = self.weights.sum(axis=0) < LEAST_SHARE
        both += mix(tiles, empty[None] * np.ones(1), [other])
        energies = [tiles.energies(one) for one in (other, own, both)]
        floor = 1e-12 * energies[0] + 1e-300
        logs = [np.log(np.maximum(one, floor)) for one in energies]
        target = (1 - self.shares) * logs[0] + self.shares * logs[1]
        change = np.clip(target - logs[2], -MOST_LOG_ENERGY, MOST_LOG_ENERGY)
        return tiles.gained(both, np.minimum(np.exp(0.5 * change), MOST_GAIN))


def _misfit(truth: FloatArray, answer: FloatArray) -> FloatArray:
    """Return the mean square of log energy errors of each tile."""
    known = (truth > 0) & (answer > 1e-6 * truth)
    ratio = np.zeros(known.shape)
    np.log(truth, out=ratio, where=known)
    ratio -= np.where(known, np.log(np.where(known, answer, 1.0)), 0.0)
    count = np.maximum(known.sum(axis=0), 1)
    square = (ratio**2).sum(axis=0) / count
    return np.where(known.any(axis=0), square, UNKNOWN_MISFIT)


def held_out_rows(data: FieldData) -> NDArray[np.bool_]:
    """Return the rows a network is first trained without: every third emitter place.

    With a single emitter place, every third listener.
    """
    places = place_numbers(data.emitters.positions)
    if len(np.unique(places)) < 2:
        places = place_numbers(data.listeners.positions)
    return places % EVERY == EVERY - 2


def join_network(
    acoustics: Acoustics,
    rows: FitSet,
    data: FieldData,
    plan: TrainingPlan,
    steps: int,
    *,
    alike: bool,
) -> tuple[FieldWithNetwork | None, str]:
    """Train a network and join it where it proves right at places left out.

    Parameters
    ----------
    acoustics : Acoustics
        The other field.
    rows : FitSet
        All measured rows.
    data : FieldData
        The same rows, to train on.
    plan : TrainingPlan
        Seed, device and limits of the training.
    steps : int
        Most optimiser steps.
    alike : bool
        Whether the devices have one pattern, so that ends may be exchanged.

    Returns
    -------
    joined : FieldWithNetwork or None
        None where the other field is better alone.
    message : str
        What was found, for the alarms.
    """
    try:
        network, hidden, own = train_network(data, plan, steps, alike=alike)
    except MissingPartError:
        return None, "no network was asked: torch is not installed"
    asked = rows.rows(np.flatnonzero(hidden))
    other = acoustics.left_out(asked, among=rows)
    joined = FieldWithNetwork.fit(network, asked.responses, other, own)
    both = joined.mixed(other, own)
    nearest = NearestRows.of(rows).left_out(asked)
    tried = {"rest": other, "both": both, "network": own, "nearest": nearest}
    proof = prove(asked, tried)
    if proof.best in ("rest", "nearest") or beaten_by_nearest(proof, proof.best):
        return None, "a trained network knows no more of this room"
    if proof.best == "network":
        return replace(joined, alone=True), "a trained network answers alone"
    ratio = proof.ratio("both", "rest")
    return joined, (
        f"a trained network is joined to the rest: {ratio:.2f} of its errors at "
        "places left out"
    )


def train_network(
    data: FieldData, plan: TrainingPlan, steps: int, *, alike: bool
) -> tuple[SymmetricNetwork, NDArray[np.bool_], FloatArray]:
    """Train a network twice: without some rows to be asked for them, then with all.

    Returns
    -------
    network : SymmetricNetwork
        Trained on all rows.
    hidden : ndarray, shape (rows,)
        Rows it was first trained without.
    answers : ndarray, shape (hidden, n_samples)
        What it predicted for them then.

    Raises
    ------
    MissingPartError
        If torch is not installed.
    """
    require("torch", why="the network of the path field")
    inras = FIELDS["inras"].load_module()
    from fields.training.loop import Trainer

    hidden = held_out_rows(data)
    few = min(steps, plan.steps)
    budget = None if plan.budget_s is None else 0.5 * plan.budget_s
    plan = replace(
        plan,
        steps=few,
        epochs=None,
        budget_s=budget,
        batch_size=BATCH_ROWS,
        exchange="double" if alike else "none",
        self_supervised="none",
        out=None,
        resume=False,
        watch=None,
    )
    config = inras.Config(tied=alike, oriented=not alike)
    shown = np.flatnonzero(~hidden)
    field = inras.fit(data.rows(shown), config, plan)
    asked = np.flatnonzero(hidden)
    ends = data.emitters[asked], data.listeners[asked]
    answers = SymmetricNetwork(field, alike).predict(*ends, data.frame.n_samples)
    field.report = Trainer(field.network, data, plan).run()
    return SymmetricNetwork(field, alike), hidden, answers

"""A trained network beside the paths, heard where it proved right.

Where no geometry explains a room, a network may know more of it than rows do. It is
trained without some emitter places, held against the rest there, and joined to it tile
by tile, or not at all. Both orders of the ends ask it the same question, so that its
answers do not change when they are exchanged.
"""

import io
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fields.data import FieldData
from fields.plan import TrainingPlan
from inverse.blend.mixture import mix, mixing_weights
from inverse.late.tiles import Tiles
from inverse.rows.fitset import place_numbers
from rir import Poses
from rir.optional import require

__all__ = ["Joined", "Network", "held_out_rows", "train_network"]

FloatArray = NDArray[np.float64]
EVERY = 3
MOST_GAIN = 2.0
LEAST_SHARE = 1e-2


@dataclass(frozen=True, eq=False)
class Network:
    """Answer from a trained network, the same both ways.

    Parameters
    ----------
    field : NetworkField
        The trained network.
    alike : bool
        Whether the devices have one pattern, so that ends may be exchanged.
    """

    field: Any
    alike: bool

    def predict(self, emitters: Poses, listeners: Poses, n_samples: int) -> FloatArray:
        """Return responses, shape (queries, n_samples), a direct sound 1/distance."""
        if self.alike:
            emitters, listeners = _ordered(emitters, listeners)
        # One by one: rows of a batch may round differently in another batch.
        said = [
            self.field.predict(emitters[k : k + 1], listeners[k : k + 1])
            for k in range(len(emitters))
        ]
        answers = np.concatenate(said).astype(np.float64) / self.field.frame.scale
        return answers[:, :n_samples]

    def as_bytes(self) -> NDArray[np.uint8]:
        """Return the network's file as numbers."""
        import torch

        from fields.training.network import SCHEMA

        held = io.BytesIO()
        field = self.field
        stored = {
            "schema": SCHEMA,
            "model": field.name,
            "config": vars(field.config),
            "frame": field.frame.as_dict(),
            "report": field.report,
            "state": field.network.state_dict(),
        }
        torch.save(stored, held)
        return np.frombuffer(held.getvalue(), dtype=np.uint8)

    @classmethod
    def from_bytes(cls, stored: NDArray[np.uint8], alike: bool) -> "Network":
        """Rebuild what :meth:`as_bytes` returned."""
        from fields.models import inras

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
class Joined:
    """Hold a network and how far it is believed beside the rest.

    Parameters
    ----------
    network : Network
        The network.
    weights : ndarray, shape (2, bands, bins)
        Amplitudes of the rest's and of the network's waveforms.
    shares : ndarray, shape (bands, bins)
        How much of the energy, in decibels, is the network's.
    tiles : Tiles
        Octaves and bins.
    alone : bool
        Whether the network answers alone.
    """

    network: Network
    weights: FloatArray
    shares: FloatArray
    tiles: Tiles
    alone: bool = False

    @classmethod
    def fit(
        cls, network: Network, measured: FloatArray, told: FloatArray, said: FloatArray
    ) -> "Joined":
        """Join what the rest and the network say of rows neither has heard."""
        frame = network.field.frame
        tiles = Tiles(float(frame.sample_rate), measured.shape[1])
        weights = mixing_weights(measured, [told, said], tiles)
        truth = tiles.energies(measured)
        misfits = [_misfit(truth, tiles.energies(one)) for one in (told, said)]
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
    def from_arrays(cls, arrays: dict[str, np.ndarray]) -> "Joined":
        """Rebuild what :meth:`as_arrays` returned."""
        network = Network.from_bytes(arrays["network"], bool(arrays["alike"]))
        frame = network.field.frame
        tiles = Tiles(float(frame.sample_rate), int(frame.n_samples))
        parts = arrays["weights"], arrays["shares"]
        return cls(network, *parts, tiles, bool(arrays["alone"]))

    def apply(self, told: FloatArray, emitters: Poses, listeners: Poses) -> FloatArray:
        """Return answers of both, shape (rows, n_samples)."""
        said = self.network.predict(emitters, listeners, told.shape[1])
        return said if self.alone else self.joined(told, said)

    def joined(self, told: FloatArray, said: FloatArray) -> FloatArray:
        """Return the sum of two answers, its energies between theirs in decibels."""
        tiles = self.tiles
        both = mix(tiles, self.weights, [told, said])
        # Where neither waveform was right their sum is empty: take the rest's.
        empty = self.weights.sum(axis=0) < LEAST_SHARE
        both += mix(tiles, empty[None] * np.ones(1), [told])
        levels = [tiles.energies(one) for one in (told, said, both)]
        least = [np.maximum(one, 1e-12 * levels[0] + 1e-300) for one in levels]
        target = (1 - self.shares) * np.log(least[0]) + self.shares * np.log(least[1])
        gains = np.exp(0.5 * np.clip(target - np.log(least[2]), -6, 6))
        return tiles.gained(both, np.minimum(gains, MOST_GAIN))


def _misfit(truth: FloatArray, told: FloatArray) -> FloatArray:
    """Return the mean square of log energy errors of each tile."""
    known = (truth > 0) & (told > 1e-6 * truth)
    ratio = np.zeros(known.shape)
    np.log(truth, out=ratio, where=known)
    ratio -= np.where(known, np.log(np.where(known, told, 1.0)), 0.0)
    count = np.maximum(known.sum(axis=0), 1)
    return np.where(known.any(axis=0), (ratio**2).sum(axis=0) / count, 1e3)


def held_out_rows(data: FieldData) -> NDArray[np.bool_]:
    """Return the rows a network is not shown at first, of every third place.

    Of the emitter; with a single one, every third listener.
    """
    places = place_numbers(data.emitters.positions)
    if len(np.unique(places)) < 2:
        places = place_numbers(data.listeners.positions)
    return places % EVERY == EVERY - 2


def train_network(
    data: FieldData, plan: TrainingPlan, steps: int, *, alike: bool
) -> tuple[Network, NDArray[np.bool_], FloatArray]:
    """Train a network twice: without some rows to be asked for them, then with all.

    Returns
    -------
    network : Network
        Trained on all rows.
    hidden : ndarray, shape (rows,)
        Rows it had not heard at first.
    said : ndarray, shape (hidden, n_samples)
        What it said of them then.

    Raises
    ------
    MissingPartError
        If torch is not installed.
    """
    require("torch", why="the network of the path field")
    from fields.models import inras
    from fields.training.loop import Trainer

    hidden = held_out_rows(data)
    few = min(steps, plan.steps)
    budget = None if plan.budget_s is None else 0.5 * plan.budget_s
    plan = replace(
        plan,
        steps=few,
        epochs=None,
        budget_s=budget,
        batch_size=32,
        exchange="double" if alike else "none",
        self_supervised="none",
        out=None,
        resume=False,
        watch=None,
    )
    config = inras.Config(tied=alike, oriented=not alike)
    shown = np.flatnonzero(~hidden)
    field = inras.fit(data.rows(shown), config, plan)
    unheard = np.flatnonzero(hidden)
    ends = data.emitters[unheard], data.listeners[unheard]
    said = Network(field, alike).predict(*ends, data.frame.n_samples)
    report = Trainer(field.network, data, plan).run()
    field.report = report
    return Network(field, alike), hidden, said

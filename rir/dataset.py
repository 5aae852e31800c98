"""Responses with their poses: any number of sessions read as one data set."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.dataset_file import FilePart, MemoryPart, Part
from rir.dataset_writer import DatasetWriter
from rir.errors import DatasetError
from rir.gain import GainPattern
from rir.layout import COLUMNS, empty_column
from rir.pose import Poses
from rir.records import Environment, Measurement, PairRecord, Provenance
from rir.response import ImpulseResponse, as_samples, check_sample_rate
from rir.room import RoomSpec
from rir.rows import PairRows, Responses, Rows

__all__ = ["Dataset", "PairRows", "Responses"]


class Dataset:
    """Rows of responses with poses, from files or from memory.

    Make one with `Dataset.open` or `Dataset.from_arrays`. Rows of several
    sessions follow one another; where sessions store different lengths, the
    shortest is served.

    Raises
    ------
    DatasetError
        If the sessions have different sample rates.
    """

    def __init__(self, parts: Sequence[Part], rows: Rows | None = None) -> None:
        if not parts:
            raise DatasetError("a data set needs at least one session or array")
        rates = sorted({part.sample_rate for part in parts})
        if len(rates) > 1:
            raise DatasetError(
                f"sessions differ in sample rate ({', '.join(map(str, rates))} Hz):"
                " read them one by one, or resample"
            )
        self._parts = list(parts)
        self._starts = np.cumsum([0, *(part.shape[0] for part in parts)])
        self._rows = np.arange(self._starts[-1]) if rows is None else np.asarray(rows)
        self.sample_rate: int = rates[0]
        self.n_samples: int = min(part.shape[1] - part.pre for part in parts)

    @staticmethod
    def open(*paths: str | Path) -> "Dataset":
        """Open session folders or ``.h5`` files as one data set.

        Raises
        ------
        DatasetError
            If a file is missing, broken, newer than this program, or unfit, or
            something else than a path is given.
        """
        for path in paths:
            if not isinstance(path, str | Path):
                raise DatasetError(
                    f"a data set is opened from paths, not from {type(path).__name__}; "
                    "arrays become one with Dataset.from_arrays"
                )
        return Dataset([FilePart(path) for path in paths])

    @staticmethod
    def from_arrays(
        responses: ArrayLike,
        emitters: Any,
        listeners: Any,
        *,
        sample_rate: int,
        simulated: bool = True,
        room: RoomSpec | None = None,
        room_name: str = "",
        session: str = "memory",
        emitter_gain: GainPattern | None = None,
        listener_gain: GainPattern | None = None,
        columns: Mapping[str, Any] | None = None,
        metadata: Mapping[str, Any] | None = None,
    ) -> "Dataset":
        """Make a data set in memory.

        Parameters
        ----------
        responses : array_like, shape (E, L, n) or (N, n)
            All pairs of E emitters and L listeners, or N rows.
        emitters : Poses or what `Poses.of` takes
            E poses, or N.
        listeners : Poses or what `Poses.of` takes
            L poses, or N.
        sample_rate : int
            Samples per second [Hz].
        simulated : bool
            Whether no microphone heard it; say so if one did.
        room, room_name, session, emitter_gain, listener_gain, columns, metadata
            What is known of the origin; columns have one value per row.

        Examples
        --------
        >>> ds = Dataset.from_arrays(
        ...     np.zeros((2, 3, 16)), np.eye(2, 3), np.ones((3, 3)), sample_rate=8000
        ... )
        >>> len(ds), ds.responses[4:].shape
        (6, (2, 16))
        """
        samples = as_samples(responses)
        ends = [Poses.of(emitters), Poses.of(listeners)]
        table = {"emitter_id": np.arange(len(samples))}
        if samples.ndim == 3:
            grid = samples.shape[:2]
            if grid != (len(ends[0]), len(ends[1])):
                raise DatasetError(
                    f"responses {samples.shape} do not fit {len(ends[0])} emitters"
                    f" × {len(ends[1])} listeners"
                )
            e, r = (index.ravel() for index in np.indices(grid))
            table = {"emitter_id": e, "listener_id": r}
            ends = [ends[0][e], ends[1][r]]
            samples = samples.reshape(-1, samples.shape[2])
        else:
            table = {}
        if samples.ndim != 2 or not len(samples) or not samples.shape[1]:
            raise DatasetError(
                f"responses need shape (E, L, n) or (N, n), not {samples.shape}"
            )
        for end, name in zip(ends, ("emitter", "listener"), strict=True):
            if len(end) != len(samples):
                raise DatasetError(
                    f"{len(end)} {name} poses for {len(samples)} responses"
                )
        table |= {name: np.asarray(v) for name, v in (columns or {}).items()}
        gains = {"emitter": emitter_gain, "listener": listener_gain}
        part = MemoryPart(
            samples,
            check_sample_rate(sample_rate),
            ends[0],
            ends[1],
            simulated,
            session=session,
            room=room,
            room_name=room.name if room else room_name,
            metadata=dict(metadata or {}),
            gains={end: gain for end, gain in gains.items() if gain is not None},
            table=table,
        )
        return Dataset([part])

    def __len__(self) -> int:
        return len(self._rows)

    @property
    def responses(self) -> Responses:
        """The responses, read when indexed."""
        return Responses(self.read, (len(self), self.n_samples))

    def read(self, rows: ArrayLike, *, with_pre: bool = False) -> NDArray[Any]:
        """Return responses of the given rows, shape (k, n).

        Parameters
        ----------
        rows : array_like of int
            Rows, in any order.
        with_pre : bool
            Also return the `pre` samples before the emission.
        """
        wanted = self._rows[np.asarray(rows, dtype=np.intp)]
        owner = np.searchsorted(self._starts, wanted, side="right") - 1
        blocks = [(owner == index, part) for index, part in enumerate(self._parts)]
        used = [(mask, p, wanted[mask]) for mask, p in blocks if mask.any()]
        if not used:
            return np.empty((0, self.n_samples))
        ahead = self.pre if with_pre else 0
        result: NDArray[Any] | None = None
        for mask, part, own in used:
            block = part.read(own - self._starts[self._parts.index(part)])
            start = part.pre - ahead
            block = block[:, start : part.pre + self.n_samples]
            if len(used) == 1:
                return block
            if result is None:
                result = np.empty((len(wanted), block.shape[1]), dtype=np.float64)
            result[mask] = block
        return result if result is not None else np.empty((0, self.n_samples))

    @property
    def pre(self) -> int:
        """Samples before the emission that every row has."""
        return min(part.pre for part in self._parts)

    @cached_property
    def emitters(self) -> Poses:
        """Emitter poses, one per row."""
        return self._poses("emitters")

    @cached_property
    def listeners(self) -> Poses:
        """Listener poses, one per row."""
        return self._poses("listeners")

    def _poses(self, end: str) -> Poses:
        ends = [getattr(part, end) for part in self._parts]
        positions = np.concatenate([poses.positions for poses in ends])
        orientations = np.concatenate([poses.orientations for poses in ends])
        return Poses(positions[self._rows], orientations[self._rows])

    @cached_property
    def table(self) -> Mapping[str, NDArray[Any]]:
        """Columns by name, one value per row; absent values are NaN, -1 or empty."""
        names = {name for part in self._parts for name in part.table}
        table = {name: self._column(name) for name in sorted(names | set(COLUMNS))}
        sessions = [np.full(p.shape[0], p.session) for p in self._parts]
        table["session"] = np.concatenate(sessions)[self._rows]
        return table

    def _column(self, name: str) -> NDArray[Any]:
        found = [part.table.get(name) for part in self._parts]
        like = next((values for values in found if values is not None), None)
        columns = [
            empty_column(like, name, part.shape[0]) if values is None else values
            for part, values in zip(self._parts, found, strict=True)
        ]
        return np.concatenate(columns)[self._rows]

    @property
    def simulated(self) -> bool:
        """Whether any row was simulated."""
        return any(part.simulated for part in self._parts)

    @property
    def mark(self) -> str:
        """SIMULATED, MEASURED, or both: the word to show beside every figure."""
        kinds = sorted({part.simulated for part in self._parts})
        return " and ".join("SIMULATED" if kind else "MEASURED" for kind in kinds)

    @property
    def room_names(self) -> list[str]:
        """Names of the rooms, in order of first appearance."""
        return list(dict.fromkeys(part.room_name for part in self._parts))

    @property
    def rooms(self) -> list[RoomSpec | None]:
        """The room of each session, where known."""
        return [part.room for part in self._parts]

    @property
    def sessions(self) -> list[dict[str, Any]]:
        """What each session says of itself."""
        return [
            {
                "session": part.session,
                "room_name": part.room_name,
                "simulated": part.simulated,
                "rows": part.shape[0],
                **part.metadata,
            }
            for part in self._parts
        ]

    @property
    def extras(self) -> list[Mapping[str, NDArray[Any]]]:
        """Further arrays of each session, such as the excitation."""
        return [part.extras for part in self._parts]

    @property
    def emitter_gain(self) -> GainPattern | None:
        """Gain pattern of the emitter, where all sessions agree on one."""
        return self._gain("emitter")

    @property
    def listener_gain(self) -> GainPattern | None:
        """Gain pattern of the listener, where all sessions agree on one."""
        return self._gain("listener")

    def _gain(self, end: str) -> GainPattern | None:
        gains = [part.gains.get(end) for part in self._parts]
        return gains[0] if all(gain == gains[0] for gain in gains) else None

    def subset(self, rows: ArrayLike) -> "Dataset":
        """Return the data set of the given rows (numbers or a mask)."""
        return Dataset(self._parts, self._rows[np.asarray(rows)])

    def measurement(self, row: int) -> Measurement:
        """Return one row with everything known of it."""
        owner = int(np.searchsorted(self._starts, self._rows[row], side="right")) - 1
        part, table = self._parts[owner], self.table
        air = (table[key][row] for key in Environment.__dataclass_fields__)
        return Measurement(
            self.emitters[row],
            self.listeners[row],
            ImpulseResponse(self.responses[row], self.sample_rate),
            Provenance(part.simulated, part.session),
            Environment(*(float(value) for value in air)),
            part.gains.get("emitter"),
            part.gains.get("listener"),
        )

    def __iter__(self) -> Iterator[Measurement]:
        return (self.measurement(row) for row in range(len(self)))

    def pairs(self, *, accepted_only: bool = True) -> list[PairRows]:
        """Return the reciprocity pairs in order of session and pair number."""
        table = self.table
        usable = np.asarray(table["pair_id"]) >= 0
        if accepted_only:
            usable &= np.asarray(table["accepted"], dtype=bool)
        rows = np.flatnonzero(usable)
        keys = {(str(table["session"][r]), int(table["pair_id"][r])) for r in rows}
        direction = table["direction"]
        order = {part.session: index for index, part in enumerate(self._parts)}
        return [
            PairRows(
                session,
                pair,
                *(
                    rows[
                        (table["session"][rows] == session)
                        & (table["pair_id"][rows] == pair)
                        & (direction[rows] == way)
                    ]
                    for way in ("AB", "BA")
                ),
            )
            for session, pair in sorted(keys, key=lambda key: (order[key[0]], key[1]))
        ]

    def pair_record(self, pair: PairRows, tolerance: float = 0.005) -> PairRecord:
        """Return the first take of each direction as a checked pair."""
        if not pair.complete:
            raise DatasetError(
                f"pair {pair.pair_id} of {pair.session} lacks a direction"
            )
        forward, reverse = (
            self.measurement(int(rows[0])) for rows in (pair.forward, pair.reverse)
        )
        return PairRecord(forward, reverse, tolerance)

    def save(self, path: str | Path, *, dtype: str = "float64") -> Path:
        """Write the rows of one session, or of memory, to a file.

        Raises
        ------
        DatasetError
            If the data set spans several sessions: save each on its own.
        """
        if len(self._parts) > 1:
            raise DatasetError("several sessions do not fit one file: save each")
        part = self._parts[0]
        with DatasetWriter(
            path,
            sample_rate=self.sample_rate,
            n_samples=self.n_samples,
            simulated=part.simulated,
            pre=part.pre,
            dtype=dtype,
            session=part.session,
            room=part.room,
            room_name=part.room_name,
            metadata={k: v for k, v in part.metadata.items() if k != "software"},
            emitter_gain=part.gains.get("emitter"),
            listener_gain=part.gains.get("listener"),
            extras=part.extras,
        ) as writer:
            for start in range(0, len(self), 256):
                rows = np.arange(start, min(start + 256, len(self)))
                columns = {k: self.table[k][rows] for k in part.table}
                block = self.read(rows, with_pre=True)
                writer.append(block, self.emitters[rows], self.listeners[rows], columns)
        return writer.path

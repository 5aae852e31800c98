"""Write data sets row by row; the finished file appears at once or not at all."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.config import dump_yaml
from rir.errors import DatasetError
from rir.gain import GainPattern
from rir.layout import DATA_SET, empty_column
from rir.pose import Poses
from rir.records import software_version
from rir.response import check_sample_rate
from rir.room import RoomSpec

__all__ = ["DatasetWriter"]

_CHUNK_BYTES = 32768
"""Of a chunk: one row is read with little else; far below HDF5's cache of 1 MiB."""


class DatasetWriter:
    """Append rows to a new data-set file.

    Rows go to a hidden partial file that takes the final name on `close`, so a
    reader never meets half a data set. The same rows in the same order give the
    same bytes.

    Parameters
    ----------
    path : path
        File to make; ends in ``.h5``.
    sample_rate : int
        Samples per second [Hz].
    n_samples : int
        Samples per response from the emission on.
    simulated : bool
        Whether no microphone heard it.
    pre : int
        Samples stored before the emission.
    dtype : {"float32", "float64"}
        How samples are stored.
    session, room, metadata, created_utc
        What the file says of its origin.
    emitter_gain, listener_gain : GainPattern, optional
        Patterns of the devices, where known.
    extras : mapping, optional
        Further arrays, stored by name.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> from rir.dataset import Dataset
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "two.h5"
    >>> with DatasetWriter(path, sample_rate=8000, n_samples=4, simulated=True) as out:
    ...     out.append(np.eye(2, 4), np.zeros((2, 3)), np.ones((2, 3)))
    >>> Dataset.open(path).responses[1].tolist()
    [0.0, 1.0, 0.0, 0.0]
    """

    def __init__(
        self,
        path: str | Path,
        *,
        sample_rate: int,
        n_samples: int,
        simulated: bool,
        pre: int = 0,
        dtype: str = "float32",
        session: str = "",
        room: RoomSpec | None = None,
        room_name: str = "",
        metadata: Mapping[str, Any] | None = None,
        created_utc: str = "",
        emitter_gain: GainPattern | None = None,
        listener_gain: GainPattern | None = None,
        extras: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        import h5py

        self.path = Path(path)
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._partial = self.path.with_name(f".{self.path.name}.partial")
        self._width = pre + n_samples
        self._rows = 0
        try:
            self._file: Any = h5py.File(self._partial, "w", track_order=True)
        except OSError as error:
            raise DatasetError(f"cannot write {self._partial}: {error}") from error
        self._file.attrs.update(
            **DATA_SET.stamp,
            sample_rate=check_sample_rate(sample_rate),
            pre=pre,
            simulated=simulated,
            session=session or self.path.stem,
            room_name=room.name if room else room_name,
            room=dump_yaml(room) if room else "",
            metadata=json.dumps(dict(metadata or {}), sort_keys=True),
            software=software_version(),
            created_utc=created_utc,
        )
        self._make_arrays(dtype)
        self._store_gains({"emitter": emitter_gain, "listener": listener_gain})
        for name, values in (extras or {}).items():
            self._file.create_dataset(f"extra/{name}", data=np.asarray(values))

    def _make_arrays(self, dtype: str) -> None:
        rows = max(1, _CHUNK_BYTES // (np.dtype(dtype).itemsize * self._width))
        self._grow("responses", (self._width,), dtype, rows)
        for end in ("emitter", "listener"):
            self._grow(f"{end}/position", (3,), "float64", 512)
            self._grow(f"{end}/orientation", (4,), "float64", 512)

    def _grow(self, name: str, rest: tuple[int, ...], dtype: Any, chunk: int) -> None:
        self._file.create_dataset(
            name,
            shape=(0, *rest),
            maxshape=(None, *rest),
            dtype=dtype,
            chunks=(chunk, *rest),
        )

    def _store_gains(self, gains: Mapping[str, GainPattern | None]) -> None:
        for end, gain in gains.items():
            if gain is not None:
                self._file[f"gain/{end}/coefficients"] = gain.coefficients
                self._file[f"gain/{end}/bands"] = gain.bands

    def __len__(self) -> int:
        return self._rows

    def append(
        self,
        responses: ArrayLike,
        emitters: Any,
        listeners: Any,
        columns: Mapping[str, Any] | None = None,
    ) -> None:
        """Append rows.

        Parameters
        ----------
        responses : array_like, shape (k, pre + n_samples)
            Samples, ``pre`` of them before the emission.
        emitters, listeners : Poses or what `Poses.of` takes
            One pose per row, or one for all.
        columns : mapping, optional
            Column name to k values, or to one value for all.

        Raises
        ------
        DatasetError
            If shapes do not fit, or a sample is not finite.
        """
        samples = np.atleast_2d(np.asarray(responses))
        if samples.ndim != 2 or samples.shape[1] != self._width:
            raise DatasetError(
                f"rows of {self._width} samples are needed, not shape {samples.shape}"
            )
        if not np.isfinite(samples).all():
            raise DatasetError("a response holds NaN or infinity: not stored")
        count = len(samples)
        ends = {"emitter": Poses.of(emitters), "listener": Poses.of(listeners)}
        for end, poses in ends.items():
            if len(poses) not in (1, count):
                raise DatasetError(f"{len(poses)} {end} poses for {count} responses")
        self._extend("responses", samples)
        for end, poses in ends.items():
            self._extend(f"{end}/position", _spread(poses.positions, count))
            self._extend(f"{end}/orientation", _spread(poses.orientations, count))
        self._append_columns(columns or {}, count)
        self._rows += count

    def _extend(self, name: str, values: NDArray[Any]) -> None:
        stored = self._file[name]
        stored.resize(len(stored) + len(values), axis=0)
        stored[-len(values) :] = values

    def _append_columns(self, columns: Mapping[str, Any], count: int) -> None:
        given = {
            name: _spread(np.atleast_1d(np.asarray(v)), count)
            for name, v in columns.items()
        }
        stored = self._file.require_group("table")
        for name in sorted({*given, *stored}):
            values = given.get(name)
            if name not in stored:
                before = empty_column(values, name, self._rows)
                self._store_column(name, _encoded(before), _encoded(values))
            else:
                old = stored[name][:]
                added = empty_column(_decoded(old), name, count)
                added = added if values is None else values
                self._store_column(name, old, _encoded(added))

    def _store_column(self, name: str, old: NDArray[Any], new: Any) -> None:
        path = f"table/{name}"
        dtype = np.result_type(old, new) if len(old) else new.dtype
        if path in self._file and self._file[path].dtype == dtype:
            self._extend(path, new)
            return
        if path in self._file:
            del self._file[path]
        self._grow(path, (), dtype, 1024)
        if len(old):
            self._extend(path, old.astype(dtype))
        self._extend(path, new.astype(dtype))

    def close(self) -> Path:
        """Finish the file and give it its name."""
        self._file.close()
        with self._partial.open("rb") as stream:
            os.fsync(stream.fileno())
        self._partial.replace(self.path)
        return self.path

    def discard(self) -> None:
        """Drop the partial file; nothing appears under the final name."""
        self._file.close()
        self._partial.unlink(missing_ok=True)

    def __enter__(self) -> "DatasetWriter":
        return self

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        if kind is None:
            self.close()
        else:
            self.discard()


def _spread(values: NDArray[Any], count: int) -> NDArray[Any]:
    if len(values) not in (1, count):
        raise DatasetError(f"{len(values)} values for {count} rows")
    return np.repeat(values, count, axis=0) if len(values) != count else values


def _encoded(values: Any) -> NDArray[Any]:
    array = np.asarray(values)
    if array.dtype.kind != "U":
        return array
    # HDF5 has no zero-length strings.
    encoded = np.char.encode(array, "utf-8")
    return encoded.astype(f"S{max(1, encoded.dtype.itemsize)}")


def _decoded(values: NDArray[Any]) -> NDArray[Any]:
    return np.char.decode(values, "utf-8") if values.dtype.kind == "S" else values

"""SOFA files (AES69). Data sets: one measurement a response, SingleRoomSRIR."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rir import Dataset, DatasetError, Poses, ResoundingError
from rir.arrays import FloatArray
from rir.files.table import FORMATS, Format, is_simulated
from rir.optional import require
from rir.physics import ZERO_CELSIUS_K
from rir.pose import from_spherical, rotate
from rir.records import software_version

__all__ = ["open_sofa", "rate_of", "read_sofa", "write_sofa"]


def open_sofa(path: str | Path, refusal: type[ResoundingError]) -> Any:
    """Return what a SOFA file holds, as sofar gives it.

    Raises
    ------
    MissingPartError
        If sofar is not installed.
    ResoundingError
        Of the type `refusal`, if the file cannot be read.
    """
    sofar = require("sofar", why="reading SOFA files")
    try:
        return sofar.read_sofa(str(path), verify=False, verbose=False)
    except (OSError, ValueError) as error:
        raise refusal(f"cannot read {path} as SOFA: {error}") from error


def rate_of(sofa: Any) -> float:
    """Return the sample rate of a file's impulse responses [Hz]."""
    return float(np.ravel(sofa.Data_SamplingRate)[0])


def write_sofa(dataset: Dataset, path: Path) -> None:
    """Write a data set as a SOFA file that sofar itself finds correct.

    Parameters
    ----------
    dataset : Dataset
        The responses; each becomes a measurement with one receiver.
    path : Path
        Ends in ``.sofa``.

    Raises
    ------
    MissingPartError
        If sofar is not installed.
    """
    sofar = require("sofar", why="SOFA")
    sofa = sofar.Sofa("SingleRoomSRIR")
    count = len(dataset)
    sofa.Data_IR = np.asarray(dataset.responses[:], dtype=float)[:, None, :]
    sofa.Data_SamplingRate = float(dataset.sample_rate)
    sofa.Data_Delay = np.zeros((1, 1))
    _write_poses(sofa, "Source", dataset.emitters)
    _write_poses(sofa, "Listener", dataset.listeners)
    for end in ("Emitter", "Receiver"):
        setattr(sofa, f"{end}Position", np.zeros((1, 3)))
        setattr(sofa, f"{end}Position_Type", "cartesian")
        setattr(sofa, f"{end}Position_Units", "metre")
    sofa.MeasurementDate = _seconds(dataset.table["time_utc"], count)
    _write_temperature(sofa, np.asarray(dataset.table["temperature_c"], dtype=float))
    sofa.GLOBAL_RoomType = "reverberant"
    sofa.GLOBAL_Title = ", ".join(dataset.room_names) or "room impulse responses"
    sofa.GLOBAL_Origin = software_version()
    sofa.GLOBAL_Comment = dataset.mark
    sofa.GLOBAL_DatabaseName = dataset.mark
    sofa.add_variable(
        "PairIndex", np.asarray(dataset.table["pair_id"], float), "double", "M"
    )
    directions = np.array(dataset.table["direction"]).astype(str)[:, None]
    sofa.add_variable("PairDirection", directions, "string", "MS")
    sofa.verify()
    sofar.write_sofa(str(path), sofa)


def _write_poses(sofa: Any, end: str, poses: Poses) -> None:
    setattr(sofa, f"{end}Position", poses.positions)
    setattr(sofa, f"{end}Position_Type", "cartesian")
    setattr(sofa, f"{end}Position_Units", "metre")
    view = rotate(poses.orientations, np.array([1.0, 0.0, 0.0]))
    up = rotate(poses.orientations, np.array([0.0, 0.0, 1.0]))
    setattr(sofa, f"{end}View", view)
    setattr(sofa, f"{end}Up", up)
    setattr(sofa, f"{end}View_Type", "cartesian")
    setattr(sofa, f"{end}View_Units", "metre")


def _write_temperature(sofa: Any, temperature_c: FloatArray) -> None:
    """Write temperatures where every row has one; SOFA knows kelvin only."""
    if np.isfinite(temperature_c).all():
        sofa.RoomTemperature = temperature_c + ZERO_CELSIUS_K
        sofa.RoomTemperature_Units = "kelvin"


def _seconds(times: Any, count: int) -> FloatArray:
    """Return seconds since 1970; 0 where nobody noted the time."""
    seconds = np.zeros(count)
    for row, text in enumerate(times):
        if text:
            seconds[row] = datetime.fromisoformat(str(text)).astimezone(UTC).timestamp()
    return seconds


def read_sofa(path: Path, simulated: bool | None) -> Dataset:
    """Read a SOFA file with impulse responses, one or several receivers.

    Raises
    ------
    MissingPartError
        If sofar is not installed.
    DatasetError
        If the file holds no impulse responses.
    """
    sofa = open_sofa(path, DatasetError)
    if not hasattr(sofa, "Data_IR") or np.ndim(sofa.Data_IR) != 3:
        raise DatasetError(f"{path} holds no impulse responses (Data.IR, M × R × N)")
    responses = np.asarray(sofa.Data_IR, dtype=float)
    count, receivers, n = responses.shape
    said = {"SIMULATED": True, "MEASURED": False}.get(str(sofa.GLOBAL_Comment))
    about = {} if said is None else {"simulated": said}
    rows = np.repeat(np.arange(count), receivers)
    return Dataset.from_arrays(
        responses.reshape(-1, n),
        _read_poses(sofa, "Source", count)[rows],
        _with_receivers(sofa, _read_poses(sofa, "Listener", count), receivers),
        sample_rate=round(rate_of(sofa)),
        simulated=is_simulated(simulated, about, path),
        room_name=str(sofa.GLOBAL_Title),
        session=path.stem,
        columns={name: column[rows] for name, column in _columns(sofa, count).items()},
    )


def _columns(sofa: Any, count: int) -> dict[str, NDArray[Any]]:
    columns: dict[str, NDArray[Any]] = {}
    if hasattr(sofa, "PairIndex"):
        columns["pair_id"] = np.ravel(sofa.PairIndex).astype(int)
        columns["direction"] = np.ravel(sofa.PairDirection).astype(str)
    kelvin = np.ravel(getattr(sofa, "RoomTemperature", np.nan)).astype(float)
    # conventions fill in 0 where nobody measured: that is no temperature of a room
    kelvin[kelvin <= 0] = np.nan
    if getattr(sofa, "RoomTemperature_Units", "") == "kelvin":
        columns["temperature_c"] = np.broadcast_to(
            kelvin - ZERO_CELSIUS_K, (count,)
        ).copy()
    return columns


def _cartesian(sofa: Any, name: str) -> FloatArray:
    """Return coordinates of a SOFA variable in metres, shape (rows, 3)."""
    values = np.atleast_2d(np.asarray(getattr(sofa, name), dtype=float))
    values = values[..., 0] if values.ndim == 3 else values
    if getattr(sofa, f"{name}_Type", "cartesian") != "spherical":
        return values
    return from_spherical(*values[:, :3].T)


def _read_poses(sofa: Any, end: str, count: int) -> Poses:
    positions = np.broadcast_to(_cartesian(sofa, f"{end}Position"), (count, 3))
    if not hasattr(sofa, f"{end}View"):
        return Poses(positions)
    view = np.broadcast_to(_cartesian(sofa, f"{end}View"), (count, 3))
    up = np.broadcast_to(_cartesian(sofa, f"{end}Up"), (count, 3))
    return Poses(positions, _quaternions(view, up))


def _quaternions(view: FloatArray, up: FloatArray) -> FloatArray:
    """Return the orientations whose front is `view` and whose top is `up`."""
    from scipy.spatial.transform import Rotation

    x = view / np.linalg.norm(view, axis=1, keepdims=True)
    z = up - np.sum(up * x, axis=1, keepdims=True) * x
    z = z / np.linalg.norm(z, axis=1, keepdims=True)
    return Rotation.from_matrix(np.stack((x, np.cross(z, x), z), axis=2)).as_quat()


def _with_receivers(sofa: Any, listeners: Poses, receivers: int) -> Poses:
    """Return each receiver's pose: the listener's, moved by its own place."""
    places = np.broadcast_to(_cartesian(sofa, "ReceiverPosition"), (receivers, 3))
    rows = np.repeat(np.arange(len(listeners)), receivers)
    turned = rotate(listeners.orientations[rows], np.tile(places, (len(listeners), 1)))
    return Poses(listeners.positions[rows] + turned, listeners.orientations[rows])


FORMATS.add("sofa")(
    Format("SOFA file, SingleRoomSRIR", read_sofa, write_sofa, suffix=".sofa")
)

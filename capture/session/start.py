"""From what a person asked for to the configuration and folder of a session."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from capture.config import SESSION, SessionConfig
from capture.plan import build_plan
from capture.session.dataset import lost_takes
from capture.session.folder import SessionFolder
from capture.session.journal import read_journal
from capture.session.placing import draw_pairs, load_pairs
from capture.session.state import SessionState
from rir import ConfigError, RoomSpec, SessionError
from rir.config import parse_yaml, validate

__all__ = [
    "SessionRequest",
    "channel_settings",
    "choose_folder",
    "is_complete",
    "is_sound",
    "plan_session",
]


HIGHEST_SHARE = 0.42
"""Upper end of the default band over the sample rate, at low rates."""


@dataclass(frozen=True)
class SessionRequest:
    """What a session is to be, in few words.

    Attributes
    ----------
    room : str
        Preset name or path of a room file.
    pairs : str
        How many pairs to draw, or the path of a file that lists them.
    settings : mapping
        Parts of the configuration, nested like ``session.yaml``; None is unset.
    config : Path or None
        A file with such parts; `settings` override it.
    """

    room: str
    pairs: str = "20"
    clearance: float = 0.5
    apart: float = 1.0
    seed: int = 0
    config: Path | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)


def plan_session(request: SessionRequest) -> SessionConfig:
    """Return the full configuration of a new session.

    Lengths that nobody set follow the room's reverberation time T as Eyring
    predicts it: sweep 8 T (its second harmonic is then 45 dB down when the linear
    response begins), silence after it 1.5 T, response 1.25 T.

    Raises
    ------
    ConfigError
        With every mistake and its place.
    """
    from rooms.presets import load_room

    room = load_room(request.room)
    data: dict[str, Any] = _lengths(room)
    if request.config is not None:
        data = merge(data, _read(request.config))
    data = merge(data, request.settings)
    rate = data.get("sample_rate", 48000)
    data["sweep"].setdefault("band_hz", [40.0, min(20000.0, HIGHEST_SHARE * rate)])
    pairs = _pairs(request, room)
    data |= {"room": room.model_dump(mode="json"), "seed": request.seed}
    data["pairs"] = [pair.model_dump() for pair in pairs]
    config = validate(data, SessionConfig, origin="the session")
    for pair in config.pairs:
        for place in (pair.a, pair.b):
            room.check_inside(place.position_m)
    return config


def _lengths(room: RoomSpec) -> dict[str, Any]:
    decay = float(np.clip(np.max(room.eyring_t60()), 0.1, 10.0))
    return {
        "sweep": {
            "seconds": round(float(np.clip(8 * decay, 1.5, 40.0)), 1),
            "tail_s": round(max(0.4, 1.5 * decay), 1),
        },
        "response_s": round(max(0.3, 1.25 * decay), 1),
    }


def _read(path: Path) -> dict[str, Any]:
    try:
        data = parse_yaml(path.read_text(encoding="utf-8"), origin=str(path))
    except OSError as error:
        raise ConfigError(f"cannot read {path}: {error.strerror}") from error
    if not isinstance(data, dict):
        raise ConfigError(f"{path} must hold keys and values, like session.yaml")
    taken = sorted({"room", "pairs", "seed"} & set(data))
    if taken:
        raise ConfigError(
            f"{path} sets {', '.join(taken)}; give these as options instead"
        )
    return SESSION.open(data, path)


def merge(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Return nested settings with others laid over them; None changes nothing.

    Examples
    --------
    >>> merge({"sweep": {"seconds": 4}}, {"sweep": {"tail_s": 1}, "takes": None})
    {'sweep': {'seconds': 4, 'tail_s': 1}}
    """
    merged = dict(base)
    for key, value in over.items():
        if isinstance(value, Mapping):
            inner = merged.get(key)
            value = merge(inner if isinstance(inner, Mapping) else {}, value)
            if not value and key not in merged:
                continue
        if value is not None:
            merged[key] = value
    return merged


def _pairs(request: SessionRequest, room: RoomSpec) -> list[Any]:
    if not request.pairs.isdigit():
        return load_pairs(Path(request.pairs))
    return draw_pairs(
        room,
        int(request.pairs),
        rng=np.random.default_rng(request.seed),
        clearance=request.clearance,
        apart=request.apart,
    )


def channel_settings(
    inputs: str | None,
    loopback: int | None,
    outputs: str | None,
    loopback_output: int | None,
) -> dict[str, Any]:
    """Return the channel part of a configuration from options.

    Devices beyond the first are taken to stand at the same place until the
    configuration file says otherwise.

    Examples
    --------
    >>> channel_settings("1,3", 8, None, None)["microphones"]
    [1, 3]
    """
    settings: dict[str, Any] = {"loopback_output": loopback_output}
    for name, text in (("microphone", inputs), ("loudspeaker", outputs)):
        if text is not None:
            numbers = _channels(text)
            settings[f"{name}s"] = numbers
            settings[f"{name}_offsets_m"] = [[0.0, 0.0, 0.0]] * len(numbers)
    if loopback is not None:
        settings["loopback"] = loopback
    return settings


def _channels(text: str) -> list[int]:
    try:
        return [int(part) for part in text.split(",")]
    except ValueError as error:
        raise ConfigError(
            f"channels are numbers with commas between, like 1,3; not {text!r}"
        ) from error


def is_complete(folder: SessionFolder) -> bool:
    """Tell whether a session has all it planned."""
    plan = build_plan(folder.load_config())
    state = SessionState.of(read_journal(folder.journal_path).events)
    return len(state.done(plan)) == len(plan.measures)


def is_sound(folder: SessionFolder) -> bool:
    """Tell whether a complete session needs no mending.

    Raw files are read only where the data set is still to be derived from them.
    """
    text = read_journal(folder.journal_path)
    if text.complaints():
        return False
    if folder.dataset_path.exists():
        return True
    return not lost_takes(folder, SessionState.of(text.events))


def choose_folder(
    out: Path | None,
    room: str,
    *,
    today: date,
    resume: bool | None,
    ask: Callable[[str], bool],
) -> SessionFolder:
    """Return the folder to work in: an unfinished session's, or a new one's.

    Parameters
    ----------
    out : Path or None
        The folder asked for; ``sessions/<room>-<date>`` when left out.
    room : str
        What was given for the room.
    today : date
        For the name of a new folder.
    resume : bool or None
        Resume an unfinished session, start a new one, or ask.
    ask : callable
        Asks a person a yes/no question.

    Raises
    ------
    SessionError
        If a new session was asked for in a folder that holds one, or an old one
        where there is none.
    """
    if out is not None:
        folder = SessionFolder(out)
        if folder.exists and resume is False:
            raise SessionError(f"{out} holds a session; give --new another --out")
        if resume and not folder.exists:
            raise SessionError(f"{out} holds no session to resume")
        return folder
    name = Path(room).stem
    unfinished = [] if resume is False else _unfinished(Path("sessions"), name)
    if unfinished:
        latest = unfinished[-1]
        if resume or ask(f"{latest.path} is unfinished: resume it?"):
            return latest
    elif resume:
        raise SessionError(f"no unfinished session of {name} under sessions/")
    return SessionFolder(_fresh(Path("sessions") / f"{name}-{today.isoformat()}"))


def _unfinished(parent: Path, name: str) -> list[SessionFolder]:
    paths = sorted(parent.glob(f"{name}-*"), key=lambda path: path.stat().st_mtime)
    folders = [SessionFolder(path) for path in paths]
    return [folder for folder in folders if folder.exists and not is_complete(folder)]


def _fresh(path: Path) -> Path:
    number, fresh = 1, path
    while fresh.exists():
        number += 1
        fresh = path.with_name(f"{path.name}-{number}")
    return fresh

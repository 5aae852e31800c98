"""Before a session: find the loopback, set the level, measure noise and distortion."""

from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

import numpy as np

from capture.config import SessionConfig
from capture.interfaces import AudioInterface
from capture.session.pairing import bands
from capture.signal.calibration import pascal_per_unit
from capture.signal.sweep import synchronized_sweep
from rir import InterfaceError
from rir.arrays import FloatArray
from rir.bands import octave_energies

__all__ = ["Preflight", "find_loopback", "octave_levels"]

START_DBFS = -40.0  # harmless to any loudspeaker, above the noise of most rooms
STEP_DB = 3.0  # 3 dB below the target is accepted: a step never misses it
TARGET_DBFS = -9.0  # headroom for a louder place of the room
HOTTEST_DBFS = -3.0  # above, peaks between the samples of a sweep may clip
LOOPBACK_CORRELATION = 0.9  # a cable comes near 1, a room stays far below
LISTEN_S = 2.0  # 44 free values in the octave of 31.5 Hz: its level to 1 dB
NONLINEAR_DB = -40.0  # 1 %: what a good loudspeaker bends; a limiter does more


@dataclass
class Preflight:
    """What the checks before a session found."""

    lines: list[str] = field(default_factory=list)
    """One line for a person per finding."""
    problems: list[str] = field(default_factory=list)
    """What must be mended before measuring."""
    amplitude_dbfs: float = np.nan
    """The level found for the sweep."""
    pascal_per_unit: float | None = None

    @staticmethod
    def of(
        interface: AudioInterface,
        config: SessionConfig,
        calibrator_db: float | None = None,
    ) -> "Preflight":
        """Run all checks on an open interface, in the order a person would.

        Parameters
        ----------
        interface : AudioInterface
            The device, open.
        config : SessionConfig
            Channels, rate and band.
        calibrator_db : float, optional
            Level of a 1 kHz calibrator on the first microphone [dB re 20 µPa]: then
            only its tone is measured.
        """
        found = Preflight()
        if calibrator_db is not None:
            found._calibrator(interface, config, calibrator_db)
            return found
        found._loopback(interface, config)
        found._level(interface, config)
        if np.isfinite(found.amplitude_dbfs):
            found._linearity(interface, config)
        found._noise(interface, config)
        return found

    def _calibrator(
        self, interface: AudioInterface, config: SessionConfig, level_db: float
    ) -> None:
        silence = np.zeros(round(LISTEN_S * config.sample_rate))
        take = interface.play_record(silence, len(silence), label="calibrator")
        self.pascal_per_unit = pascal_per_unit(
            take.samples[0], config.sample_rate, level_db
        )
        self.amplitude_dbfs = config.sweep.amplitude_dbfs
        self.lines.append(f"full scale is {self.pascal_per_unit:.3f} Pa")

    def _loopback(self, interface: AudioInterface, config: SessionConfig) -> None:
        played = short_sweep(config, START_DBFS + 10)
        take = interface.play_record(
            played, len(played), label="check loopback", output=0
        )
        found = find_loopback(take.samples, played)
        names = [*(f"input {n}" for n in config.channels.inputs)]
        if found is None:
            self.problems.append(
                "no input carries the loopback: connect an output straight to an input"
            )
            return
        self.lines.append(f"loopback found on {names[found]}")
        if found != interface.loopback:
            said = names[interface.loopback] if interface.loopback else "none"
            self.problems.append(
                f"the loopback is on {names[found]}, but {said} is configured as it"
            )

    def _level(self, interface: AudioInterface, config: SessionConfig) -> None:
        peak, level = -np.inf, START_DBFS
        while level <= HOTTEST_DBFS:
            peak, heard = self._peak(interface, config, level)
            if heard > -0.1:
                self.problems.append(
                    f"a channel clips at an output of {level:.0f} dBFS: "
                    "turn the input gain down"
                )
                return
            if peak >= TARGET_DBFS - STEP_DB:
                self.amplitude_dbfs = level
                self.lines.append(
                    f"level set: output {level:.0f} dBFS, microphone {peak:.1f} dBFS, "
                    f"headroom {-peak:.1f} dB"
                )
                return
            level += STEP_DB
        self.amplitude_dbfs = level - STEP_DB
        self.problems.append(
            f"the microphone reaches only {peak:.1f} dBFS at an output of "
            f"{self.amplitude_dbfs:.0f} dBFS: turn the microphone preamplifier up"
        )

    @staticmethod
    def _peak(
        interface: AudioInterface, config: SessionConfig, level: float
    ) -> tuple[float, float]:
        """Return the microphones' and every channel's peak at an output level."""
        played = short_sweep(config, level)
        label = f"check level {level:g}"
        take = interface.play_record(played, len(played), label=label)
        peaks = 20 * np.log10(np.abs(take.samples).max(axis=1) + 1e-12)
        microphones = peaks[: len(config.channels.microphones)]
        return float(microphones.max()), float(peaks.max())

    def _linearity(self, interface: AudioInterface, config: SessionConfig) -> None:
        """Two levels must give one response: loudspeakers with limiters do not."""
        loud, again, soft = (
            self._response(interface, config, level, number)
            for number, level in enumerate((0.0, 0.0, -6.0))
        )
        gain = float(loud @ soft / (loud @ loud))
        change = 20 * np.log10(abs(gain)) if gain else np.inf
        rest = _level_db(soft - gain * loud, soft)
        repeat = _level_db(again - loud, loud)
        self.lines.append(
            f"6 dB softer: gain changes by {change:+.2f} dB, the rest differs by "
            f"{rest:.0f} dB (two equal sweeps by {repeat:.0f} dB)"
        )
        if abs(change) > 0.1 or rest > max(NONLINEAR_DB, repeat + 10):
            self.problems.append(
                "the response depends on the level: look for a limiter, a loudness "
                "control or distortion"
            )

    def _response(
        self, interface: AudioInterface, config: SessionConfig, change: float, n: int
    ) -> FloatArray:
        played = short_sweep(config, self.amplitude_dbfs + change)
        label = f"check linearity {n}"
        take = interface.play_record(played, len(played), label=label)
        return _divided(take.samples[0], played)

    def _noise(self, interface: AudioInterface, config: SessionConfig) -> None:
        silence = np.zeros(round(LISTEN_S * config.sample_rate))
        take = interface.play_record(silence, len(silence), label="check noise")
        centers = bands(config.sample_rate, *config.sweep.band_hz)
        levels = octave_levels(take.samples[0], config.sample_rate, centers)
        listed = ", ".join(
            f"{center:g} Hz {level:.0f}"
            for center, level in zip(centers, levels, strict=True)
        )
        self.lines.append(f"noise per octave [dBFS]: {listed}")


def short_sweep(config: SessionConfig, level_dbfs: float) -> FloatArray:
    """Return a second of sweep between silences, for trying things out."""
    low, high = config.sweep.band_hz
    rate = config.sample_rate
    sweep = synchronized_sweep(
        max(low, 50.0),
        min(high, 0.45 * rate),
        1.0,
        rate,
        amplitude=10 ** (level_dbfs / 20),
    )
    silence = np.zeros(round(0.5 * rate))
    return np.concatenate((silence[: len(silence) // 2], np.asarray(sweep), silence))


def find_loopback(samples: FloatArray, played: FloatArray) -> int | None:
    """Return the channel that carries the played signal itself, if one does.

    Parameters
    ----------
    samples : ndarray, shape (channels, n)
        What the inputs heard.
    played : ndarray, shape (n,)
        What was played.

    Notes
    -----
    A cable delivers the signal with a normalised correlation near 1; a room smears
    it over hundreds of milliseconds and stays far below.
    """
    fft: Any = import_module("scipy.fft")
    n = fft.next_fast_len(2 * len(played), real=True)
    reference = np.conj(fft.rfft(played, n))
    best = [
        float(np.abs(fft.irfft(fft.rfft(channel, n) * reference, n)).max())
        / (float(np.linalg.norm(channel) * np.linalg.norm(played)) or np.inf)
        for channel in samples
    ]
    index = int(np.argmax(best))
    return index if best[index] >= LOOPBACK_CORRELATION else None


def _level_db(part: FloatArray, whole: FloatArray) -> float:
    ratio = np.linalg.norm(part) / np.linalg.norm(whole)
    return float(20 * np.log10(ratio + 1e-12))


def _divided(heard: FloatArray, played: FloatArray) -> FloatArray:
    """Return a rough response, good enough to compare two levels."""
    fft: Any = import_module("scipy.fft")
    n = fft.next_fast_len(2 * len(played), real=True)
    spectrum = fft.rfft(played, n)
    power = np.abs(spectrum) ** 2
    inverse = np.conj(spectrum) / (power + 1e-3 * power.max())
    return fft.irfft(fft.rfft(heard, n) * inverse, n)[: len(played)]


def octave_levels(
    samples: FloatArray, sample_rate: int, centers: FloatArray
) -> FloatArray:
    """Return the level of a signal per octave [dB re full-scale root mean square].

    Examples
    --------
    >>> tone = np.sin(2 * np.pi * 1000 * np.arange(8000) / 8000)
    >>> octave_levels(tone, 8000, np.array([500.0, 1000.0])).round(1).tolist()
    [-200.0, -3.0]
    """
    fft: Any = import_module("scipy.fft")
    power = 2 * np.abs(fft.rfft(samples)) ** 2 / len(samples) ** 2
    octaves = octave_energies(power, len(samples), sample_rate, centers)
    return np.maximum(-200.0, 10 * np.log10(np.maximum(octaves, 0.0) + 1e-30))


def lock_settings(config: SessionConfig, found: Preflight) -> dict[str, Any]:
    """Return the settings a session should start from, as parts of session.yaml.

    Raises
    ------
    InterfaceError
        If no level was found.
    """
    if not np.isfinite(found.amplitude_dbfs):
        raise InterfaceError("no level was found; mend the problems and check again")
    device = config.device.model_dump(mode="json") if config.device else None
    return {
        "interface": config.interface,
        "device": device,
        "sample_rate": config.sample_rate,
        "channels": config.channels.model_dump(mode="json"),
        "sweep": {
            "amplitude_dbfs": found.amplitude_dbfs,
            "band_hz": list(config.sweep.band_hz),
        },
        "calibration": config.calibration.model_dump(mode="json")
        | ({"pascal_per_unit": found.pascal_per_unit} if found.pascal_per_unit else {}),
    }

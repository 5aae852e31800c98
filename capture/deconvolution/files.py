"""Sound files in, responses out."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from capture.deconvolution.deconvolve import Deconvolution, deconvolve
from capture.signal.sweep_search import find_sweeps
from rir.arrays import FloatArray
from rir.errors import SignalError
from rir.files.audio import read_audio, write_audio

__all__ = ["DeconvolutionJob", "deconvolve_files"]

FORMATS = (".wav", ".npz", ".h5")


@dataclass(frozen=True)
class DeconvolutionJob:
    """What the command was asked to do; see its help for the fields."""

    recording: Path
    excitation: Path
    out: Path
    loopback: Path | None = None
    loopback_channel: int | None = None
    band: tuple[float, float] | None = None
    length: float | None = None
    pre: float = 0.0


def deconvolve_files(job: DeconvolutionJob) -> list[Deconvolution]:
    """Read, deconvolve and write; return one result per sweep found.

    Raises
    ------
    SignalError
        If a file cannot be used, with what is wrong.
    """
    if job.out.suffix.lower() not in FORMATS:
        raise SignalError(
            f"cannot write {job.out}: its name must end in {', '.join(FORMATS)}"
        )
    recording, rate = read_audio(job.recording)
    played, loopback, recording = _companions(job, recording, rate)
    starts = find_sweeps(
        recording if loopback is None else loopback[None], played, rate
    )
    results = []
    for number, start in enumerate(starts):
        # A sweep's part ends where the next one begins.
        begin = 0 if number == 0 else start
        stop = starts[number + 1] if number + 1 < len(starts) else recording.shape[1]
        looped = None if loopback is None else loopback[begin:stop]
        results.append(
            deconvolve(
                recording[:, begin:stop],
                played,
                rate,
                loopback=looped,
                band=job.band,
                length=None if job.length is None else max(round(job.length * rate), 1),
                pre=round(job.pre * rate),
            )
        )
    _write(job, results, rate)
    return results


def _companions(
    job: DeconvolutionJob, recording: FloatArray, rate: int
) -> tuple[FloatArray, FloatArray | None, FloatArray]:
    excitation, excitation_rate = read_audio(job.excitation)
    _same_rate(job.excitation, excitation_rate, rate)
    loopback = None
    if job.loopback is not None:
        rows, loopback_rate = read_audio(job.loopback)
        _same_rate(job.loopback, loopback_rate, rate)
        loopback = rows[_channel(job.loopback_channel or 1, rows, job.loopback)]
    elif job.loopback_channel is not None:
        index = _channel(job.loopback_channel, recording, job.recording)
        if len(recording) < 2:
            raise SignalError(
                f"{job.recording} has only the loopback channel: nothing to deconvolve"
            )
        loopback = recording[index]
        recording = np.delete(recording, index, axis=0)
    if loopback is not None and loopback.size != recording.shape[1]:
        fitted = np.zeros(recording.shape[1])
        kept = min(fitted.size, loopback.size)
        fitted[:kept] = loopback[:kept]
        loopback = fitted
    return excitation[0], loopback, recording


def _same_rate(path: Path, rate: int, wanted: int) -> None:
    if rate != wanted:
        raise SignalError(
            f"{path} has {rate} Hz, the recording {wanted} Hz; both must be the same"
        )


def _channel(number: int, rows: FloatArray, path: Path) -> int:
    if number > len(rows):
        raise SignalError(
            f"{path} has {len(rows)} channels; channel {number} is not one"
        )
    return number - 1


def _write(job: DeconvolutionJob, results: list[Deconvolution], rate: int) -> None:
    shortest = min(result.response.shape[-1] for result in results)
    responses = np.stack([result.response[..., :shortest] for result in results])
    if job.out.suffix == ".wav":
        write_audio(job.out, responses.reshape(-1, shortest), rate, "FLOAT")
        return
    told = json.dumps([result.figures for result in results])
    flags = json.dumps([list(result.flags) for result in results])
    if job.out.suffix == ".npz":
        np.savez(
            job.out,
            response=responses,
            sample_rate=rate,
            pre=results[0].pre,
            latency=np.array([result.latency for result in results]),
            drift_ppm=np.array([result.drift_ppm for result in results]),
            flags=flags,
            figures=told,
        )
        return
    _write_h5(job, responses, rate, results)


def _write_h5(
    job: DeconvolutionJob,
    responses: FloatArray,
    rate: int,
    results: list[Deconvolution],
) -> None:
    from rir import DatasetWriter, Pose, Poses

    sweeps, channels, n = responses.shape
    nowhere = Poses.of([Pose.at(0, 0, 0)] * (sweeps * channels))
    pre = results[0].pre
    writer = DatasetWriter(
        job.out,
        sample_rate=rate,
        n_samples=n - pre,
        simulated=False,
        pre=pre,
        metadata={
            "source": job.recording.name,
            "flags": [list(result.flags) for result in results],
            "poses": "unknown",
        },
    )
    columns = {"channel": np.tile(np.arange(channels), sweeps)}
    with writer:
        writer.append(responses.reshape(-1, n), nowhere, nowhere, columns=columns)

"""What a session is, as checked data: the contents of ``session.yaml``."""

from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from capture.faults import TakeFault
from capture.signal.interleave import Interleaving
from rir import Pose, RoomSpec
from rir.config import StrictModel
from rir.errors import ConfigError
from rir.schema import Schema

__all__ = [
    "SESSION",
    "Calibration",
    "Channels",
    "Device",
    "Gains",
    "PlaceConfig",
    "PlacePair",
    "PlacePairsFile",
    "SessionConfig",
    "SimulationConfig",
    "SweepConfig",
]

SESSION = Schema("session", 1, key="schema_version", unnumbered=1, error=ConfigError)
Vector = tuple[float, float, float]
NYQUIST_SHARE = 0.47  # of the sample rate: converters' filters fall above


class PlaceConfig(StrictModel):
    """Where a device stands and which way its front looks."""

    position_m: Vector
    orientation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)

    @property
    def pose(self) -> Pose:
        """Return the place as a pose."""
        return Pose(self.position_m, self.orientation)  # type: ignore[arg-type]

    @staticmethod
    def of(pose: Pose) -> "PlaceConfig":
        """Return the configuration of a pose."""
        x, y, z = (float(value) for value in pose.position)
        i, j, k, w = (float(value) for value in pose.orientation)
        return PlaceConfig(position_m=(x, y, z), orientation=(i, j, k, w))


class PlacePair(StrictModel):
    """Two places between which both directions are measured."""

    id: Annotated[str, Field(pattern=r"^[A-Za-z0-9-]{1,32}$")]
    a: PlaceConfig
    b: PlaceConfig


class ListedPair(StrictModel):
    """A pair as a person writes it: positions, the fronts face each other."""

    id: str | None = None
    a: Vector
    b: Vector


class PlacePairsFile(StrictModel):
    """A YAML file that lists pairs by hand."""

    pairs: Annotated[list[ListedPair], Field(min_length=1)]


class SweepConfig(StrictModel):
    """The excitation and the silence round it."""

    seconds: Annotated[float, Field(gt=0.05, le=120)] = 5.0
    band_hz: tuple[float, float] = (40.0, 20000.0)
    amplitude_dbfs: Annotated[float, Field(le=0)] = -12.0
    noise_s: Annotated[float, Field(ge=0.1)] = 0.5
    tail_s: Annotated[float, Field(ge=0.1)] = 1.5

    @model_validator(mode="after")
    def _band_rises(self) -> "SweepConfig":
        low, high = self.band_hz
        if not 0 < low < high:
            raise ValueError(f"band_hz must rise from above 0 Hz, not {low}…{high}")
        return self


class Channels(StrictModel):
    """Which input carries what; inputs and outputs count from 1, as on the box."""

    microphones: Annotated[tuple[int, ...], Field(min_length=1)] = (1,)
    loopback: int | None = 2
    loudspeakers: Annotated[tuple[int, ...], Field(min_length=1)] = (1,)
    loopback_output: int | None = None
    microphone_offsets_m: tuple[Vector, ...] = ((0.0, 0.0, 0.0),)
    loudspeaker_offsets_m: tuple[Vector, ...] = ((0.0, 0.0, 0.0),)

    @field_validator("loopback", mode="after")
    @classmethod
    def _none(cls, loopback: int | None) -> int | None:
        return loopback or None

    @model_validator(mode="after")
    def _distinct(self) -> "Channels":
        inputs = [*self.microphones, *([self.loopback] if self.loopback else [])]
        if len(set(inputs)) != len(inputs):
            raise ValueError(f"each input can carry one thing, not {inputs}")
        for what in ("microphone", "loudspeaker"):
            devices = getattr(self, f"{what}s")
            offsets = getattr(self, f"{what}_offsets_m")
            if len(offsets) != len(devices):
                raise ValueError(
                    f"{len(devices)} {what}s need as many {what}_offsets_m, "
                    f"not {len(offsets)}"
                )
        return self

    @property
    def inputs(self) -> list[int]:
        """Inputs recorded, in file order: microphones, then the loopback."""
        return [*self.microphones, *([self.loopback] if self.loopback else [])]


class Device(StrictModel):
    """The one audio device that plays and records."""

    name: str
    host_api: str | None = None
    block: Annotated[int, Field(ge=0)] = 0
    latency_s: Annotated[float, Field(gt=0, le=2)] = 0.2
    stall_s: Annotated[float, Field(gt=0)] = 3.0


class Gains(StrictModel):
    """What the knobs stand at, as a person read it; both directions need the same."""

    preamp_db: float | None = None
    output_db: float | None = None
    pad_db: float | None = None
    phantom: bool | None = None


class Calibration(StrictModel):
    """How full scale becomes pascal; stored with the data, not applied to them."""

    pascal_per_unit: Annotated[float, Field(gt=0)] | None = None
    microphone_file: str | None = None


class SimulationConfig(StrictModel):
    """What the simulated interface adds to the world's own responses."""

    loudspeaker: Literal["omni", "cardioid"] = "omni"
    loudspeaker_response: bool = False
    latency_samples: float = 1234.37
    noise_db: float | None = None
    converter_noise_db: float | None = None
    distortion_db: tuple[float, float] | None = None
    placement_mm: Annotated[float, Field(ge=0)] = 0.0
    temperature_sigma_c: Annotated[float, Field(ge=0)] = 0.0
    measured: str | None = None
    faults: tuple[TakeFault, ...] = ()

    @property
    def exact(self) -> bool:
        """Whether nothing random is added to a take."""
        return self.noise_db is None and self.converter_noise_db is None


class SessionConfig(StrictModel):
    """Everything a session needs to know; written beside its results."""

    schema_version: Annotated[int, Field(ge=SESSION.version, le=SESSION.version)] = (
        SESSION.version
    )
    room: RoomSpec
    pairs: Annotated[list[PlacePair], Field(min_length=1)]
    takes: Annotated[int, Field(ge=1, le=99)] = 1
    retakes: Annotated[int, Field(ge=0, le=99)] = 2
    stop_after: Annotated[int, Field(ge=1)] = 3
    seed: int = 0
    sample_rate: Annotated[int, Field(ge=8000, le=384000)] = 48000
    sweep: SweepConfig = SweepConfig()
    response_s: Annotated[float, Field(gt=0)] = 1.0
    pre_s: Annotated[float, Field(ge=0)] = 0.05
    closure: bool = False
    overlap: bool = False
    placement_sigma_mm: Annotated[float, Field(ge=0)] | None = None
    gains: Gains = Gains()
    calibration: Calibration = Calibration()
    thermometer: str | None = None
    settle_s: Annotated[float, Field(ge=0)] = 2.0
    interface: str = "simulated"
    rig: str = "simulated"
    device: Device | None = None
    channels: Channels = Channels()
    simulation: SimulationConfig | None = SimulationConfig()

    @model_validator(mode="after")
    def _band_fits(self) -> "SessionConfig":
        high, limit = self.sweep.band_hz[1], NYQUIST_SHARE * self.sample_rate
        if high > limit:
            raise ValueError(
                f"sweep.band_hz goes up to {high:g} Hz; at {self.sample_rate} Hz "
                f"it can reach {limit:g} Hz"
            )
        return self

    @model_validator(mode="after")
    def _ids_differ(self) -> "SessionConfig":
        ids = [pair.id for pair in self.pairs]
        twice = sorted({name for name in ids if ids.count(name) > 1})
        if twice:
            raise ValueError(f"pair ids must differ; twice: {', '.join(twice)}")
        return self

    @property
    def overlapping(self) -> int:
        """How many loudspeakers play in one take: 1 unless their sweeps overlap."""
        return len(self.channels.loudspeakers) if self.overlap else 1

    @property
    def interleaving(self) -> Interleaving:
        """How the sweeps of one take follow each other."""
        rate = self.sample_rate
        pre, length = round(self.pre_s * rate), round(self.response_s * rate)
        return Interleaving.of(self.overlapping, pre, length, rate)

    @property
    def simulated(self) -> bool:
        """Whether any part of what this session records is simulated."""
        return "simulated" in (self.interface, self.rig)

    @property
    def position_sigma_m(self) -> float:
        """Standard deviation of a device's place per axis [m]; 0 if not known."""
        if self.placement_sigma_mm is not None:
            return 1e-3 * self.placement_sigma_mm
        return 1e-3 * self.simulation.placement_mm if self.simulation else 0.0

"""The table of all fields: one line a model, one file a model."""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from types import ModuleType
from typing import Any

from fields.settings import change_settings
from rir.errors import ConfigError
from rir.registry import Registry


@dataclass(frozen=True)
class FieldKind:
    """Name a field model and say where it lives.

    Every model file offers ``Config`` (a class made by
    :func:`fields.settings.settings`), ``PRESETS`` of it, ``fit(data, config, plan)``
    and ``load(path)``, so that callers never ask which model it is.
    """

    module: str
    """Import path of the model's file; imported only when it is used."""
    summary: str
    """One line for a person choosing."""
    citation: str
    """Where the method was published."""
    neural: bool = True
    """Whether it needs torch."""

    def load_module(self) -> ModuleType:
        """Import the model's file.

        Raises
        ------
        MissingPartError
            If it needs torch and torch is not installed.
        """
        if self.neural:
            from rir.optional import require

            require("torch", why=f"the field in {self.module}")
        return import_module(self.module)


FIELDS: Registry[FieldKind] = Registry("field", "resounding.fields", FieldKind)


def _list(name: str, summary: str, citation: str, *, neural: bool = True) -> None:
    module = f"fields.models.{name.replace('-', '_')}"
    FIELDS.add(name)(FieldKind(module, summary, citation, neural))


_list(
    "nearest",
    "the stored response whose two ends lie nearest",
    "baseline",
    neural=False,
)
_list(
    "linear",
    "interpolation between listeners of the nearest emitter",
    "baseline",
    neural=False,
)
_list(
    "naf",
    "grid features to a log-magnitude spectrogram, random phase",
    "Luo et al., Learning Neural Acoustic Fields, NeurIPS 2022",
)
_list(
    "naf-invariant",
    "NAF over symmetric functions of the two ends",
    "Versa's ablation of a permutation-invariant NAF",
)
_list(
    "av-nerf",
    "poses and ray-cast views to a waveform (AV-NeRF-style)",
    "Liang et al., AV-NeRF, NeurIPS 2023",
)
_list(
    "avr",
    "volume rendering along rays, gain patterns exchangeable",
    "Lan et al., Acoustic Volume Rendering, NeurIPS 2024",
)
_list(
    "diffrir",
    "traced reflections with learned walls, directivity and source",
    "Wang et al., Hearing Anything Anywhere, CVPR 2024",
)
_list(
    "inras",
    "waveform decoder over bounce points (INRAS-style)",
    "Su, Chen and Shlizerman, INRAS, NeurIPS 2022",
)
_list(
    "path",
    "walls found by ear, mirror images and a late field; reciprocal, no training",
    "after Allen and Berkley 1979; Goetz, Schlecht and Pulkki 2023",
    neural=False,
)


def model_config(model: str, values: Mapping[str, Any], preset: str = "cpu") -> Any:
    """Return a model's settings: a preset, and the values that differ.

    Raises
    ------
    UnknownNameError
        If there is no such model.
    ConfigError
        If the preset, a name or a value is unknown, with all mistakes at once.
    """
    presets = FIELDS[model].load_module().PRESETS
    if preset not in presets:
        known = ", ".join(presets)
        raise ConfigError(f"{model} has no preset {preset!r}; known: {known}")
    return change_settings(presets[preset], values, model)

"""Optional parts: imported where they are needed, named when they are missing."""

from importlib import import_module
from types import ModuleType

from rir.errors import MissingPartError

__all__ = ["require"]

_REMEDIES = {
    "torch": "pip install 'resounding[fields]'",
    "tensorboard": "pip install 'resounding[tensorboard]'",
    "sofar": "pip install 'resounding[sofa]'",
    "sounddevice": (
        "pip install sounddevice, and PortAudio itself: "
        "apt install libportaudio2 (Debian), brew install portaudio (macOS)"
    ),
}


def require(module: str, *, why: str = "") -> ModuleType:
    """Import an optional module or say in one line what to install.

    Parameters
    ----------
    module : str
        Name of the module to import.
    why : str
        What it is needed for; opens the message.

    Raises
    ------
    MissingPartError
        If the module, or a system library it loads, is not there.

    Examples
    --------
    >>> require("json").dumps([1])
    '[1]'
    """
    try:
        return import_module(module)
    # PortAudio's binding raises OSError when the system library is missing.
    except (ImportError, OSError) as error:
        root = module.split(".", maxsplit=1)[0]
        remedy = _REMEDIES.get(root, f"pip install {root}")
        need = f"{why} needs" if why else "this needs"
        cause = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise MissingPartError(
            f"{need} {root}, which is not usable here ({cause}); install it: {remedy}"
        ) from error

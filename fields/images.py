"""A folder of photographs with the poses they were taken from."""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rir import Poses
from rir.errors import DatasetError

__all__ = ["PHOTO_POSES", "Photos", "read_photos"]

PHOTO_POSES = "poses.csv"
PLACE = ("x", "y", "z")
TURN = ("qx", "qy", "qz", "qw")


@dataclass(frozen=True, eq=False)
class Photos:
    """Hold photographs and where they were taken."""

    images: np.ndarray
    """Shape (photographs, 3, height, width), 0 to 1."""
    poses: Poses
    """Camera poses; x looks out of the lens."""


def read_photos(folder: str | Path, size: int = 128) -> Photos:
    """Read a folder of images and its poses.csv.

    Parameters
    ----------
    folder : str or Path
        Holds images of any kind that Pillow reads, and ``poses.csv`` with the
        columns file, x, y, z (metres) and, if the camera was turned, qx, qy, qz,
        qw (unit quaternion; x looks out of the lens, z is up).
    size : int
        Images are scaled to so many pixels in width and height.

    Raises
    ------
    DatasetError
        If the list or an image is missing or cannot be read; names it.
    """
    folder = Path(folder)
    rows = _rows(folder / PHOTO_POSES)
    images = np.stack([_image(folder / row["file"], size) for row in rows])
    try:
        places = np.array([[float(row[name]) for name in PLACE] for row in rows])
        turned = all(name in rows[0] for name in TURN)
        turns = [[float(row[name]) for name in TURN] for row in rows] if turned else []
    except (KeyError, TypeError, ValueError) as error:
        raise DatasetError(
            f"{folder / PHOTO_POSES} needs numbers in the columns file, "
            f"{', '.join(PLACE)} and, if turned, {', '.join(TURN)} ({error})"
        ) from error
    poses = Poses(places, np.array(turns)) if turned else Poses.of(places)
    return Photos(images, poses)


def _rows(path: Path) -> list[dict[str, str]]:
    if not path.is_file():
        raise DatasetError(f"no {path.name} in {path.parent}: it names the poses")
    with path.open(newline="") as lines:
        rows = list(csv.DictReader(lines))
    if not rows or "file" not in rows[0]:
        raise DatasetError(f"{path} names no image in a column file")
    return rows


def _image(path: Path, size: int) -> np.ndarray:
    from PIL import Image

    try:
        with Image.open(path) as image:
            pixels = np.asarray(image.convert("RGB").resize((size, size)))
    except OSError as error:
        raise DatasetError(f"image {path} cannot be read ({error})") from error
    return pixels.transpose(2, 0, 1).astype(np.float32) / 255

"""ResNet-18 up to its pooled features, with the names of torchvision's weights."""

from pathlib import Path

import torch
from torch import Tensor, nn

from rir.errors import MissingPartError

__all__ = ["FEATURES", "ResNet18", "find_weights"]

# Mean and spread of ImageNet's red, green and blue, as torchvision's weights want them.
MEAN = (0.485, 0.456, 0.406)
SPREAD = (0.229, 0.224, 0.225)
WIDTHS = (64, 128, 256, 512)  # channels of the four stages: He et al., 2016, table 1
FEATURES = WIDTHS[-1]


class _Block(nn.Module):
    """Two convolutions beside a shortcut (He et al., 2016, figure 2)."""

    def __init__(self, inputs: int, width: int, stride: int) -> None:
        super().__init__()
        self.conv1 = nn.Conv2d(inputs, width, 3, stride, 1, bias=False)
        self.bn1 = nn.BatchNorm2d(width)
        self.conv2 = nn.Conv2d(width, width, 3, 1, 1, bias=False)
        self.bn2 = nn.BatchNorm2d(width)
        self.downsample = (
            nn.Sequential(
                nn.Conv2d(inputs, width, 1, stride, bias=False), nn.BatchNorm2d(width)
            )
            if stride != 1 or inputs != width
            else None
        )

    def forward(self, values: Tensor) -> Tensor:
        kept = values if self.downsample is None else self.downsample(values)
        hidden = torch.relu(self.bn1(self.conv1(values)))
        return torch.relu(self.bn2(self.conv2(hidden)) + kept)


class ResNet18(nn.Module):
    """Turn images into 512 features; frozen, and always in evaluation mode."""

    def __init__(self) -> None:
        super().__init__()
        self.conv1 = nn.Conv2d(3, WIDTHS[0], 7, 2, 3, bias=False)
        self.bn1 = nn.BatchNorm2d(WIDTHS[0])
        before = WIDTHS[0]
        for number, width in enumerate(WIDTHS):
            stride = 1 if number == 0 else 2
            layer = nn.Sequential(
                _Block(before, width, stride), _Block(width, width, 1)
            )
            self.add_module(f"layer{number + 1}", layer)
            before = width
        self.register_buffer("mean", torch.tensor(MEAN)[:, None, None])
        self.register_buffer("spread", torch.tensor(SPREAD)[:, None, None])
        self.requires_grad_(requires_grad=False)
        self.train(mode=False)

    mean: Tensor
    spread: Tensor

    def train(self, mode: bool = True) -> "ResNet18":  # noqa: ARG002
        """Stay in evaluation mode: the features are frozen."""
        super().train(mode=False)
        return self

    @torch.no_grad()
    def forward(self, images: Tensor) -> Tensor:
        """Return features, shape (batch, 512), of images (batch, 3, h, w) in 0…1."""
        hidden = (images - self.mean) / self.spread
        hidden = torch.relu(self.bn1(self.conv1(hidden)))
        hidden = nn.functional.max_pool2d(hidden, 3, 2, 1)
        for number in range(len(WIDTHS)):
            hidden = getattr(self, f"layer{number + 1}")(hidden)
        return hidden.mean((2, 3))

    def read(self, path: Path) -> None:
        """Take the weights of a file in torchvision's format.

        Raises
        ------
        MissingPartError
            If the file does not hold the weights of a ResNet-18.
        """
        try:
            state = torch.load(path, map_location="cpu", weights_only=True)
            state = {k: v for k, v in state.items() if not k.startswith("fc.")}
            self.load_state_dict({"mean": self.mean, "spread": self.spread, **state})
        except Exception as error:
            cause = str(error).splitlines()[0]
            raise MissingPartError(
                f"{path} does not hold torchvision's weights of a ResNet-18 ({cause})"
            ) from error


def find_weights(path: str = "") -> Path:
    """Return the file of weights: the one named, or that in torch's own cache.

    Raises
    ------
    MissingPartError
        If there is none; nothing is downloaded.
    """
    if path:
        if Path(path).is_file():
            return Path(path)
        raise MissingPartError(f"no weights at {path}: name a resnet18-….pth file")
    cache = Path(torch.hub.get_dir()) / "checkpoints"
    found = sorted(cache.glob("resnet18-*.pth"))
    if found:
        return found[0]
    raise MissingPartError(
        f"frozen features need torchvision's weights, and {cache} holds no "
        "resnet18-….pth; fetch them with torchvision's "
        "resnet18(weights='DEFAULT'), name a file by weights=…, or use "
        "features=learned"
    )

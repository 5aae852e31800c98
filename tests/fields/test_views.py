# pyright: reportAttributeAccessIssue=false, reportArgumentType=false
# pyright: reportOptionalMemberAccess=false
import csv
from dataclasses import replace

import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose, assert_array_equal
from PIL import Image

from fields import load_field, train
from fields.data import prepare
from fields.frame import SceneFrame
from fields.images import read_photos
from fields.layers.mesh_views import MeshViews
from fields.layers.resnet import ResNet18, find_weights
from fields.layers.sights import PhotoSight
from fields.layers.views import BoxViews, panorama_directions
from fields.shape import Shape, known_shape
from rir import Dataset, RoomSpec
from rir.errors import DatasetError, MissingPartError
from rooms import Scene
from rooms.builtin import load_scene
from rooms.mesh import MeshGeometry

SMALL = {"width": 8, "depth": 1, "view_rows": 4, "view_columns": 8}


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    """A file as torchvision's: random weights, with the classifier."""
    torch.manual_seed(0)
    state = ResNet18().state_dict()
    state = {k: v for k, v in state.items() if k not in ("mean", "spread")}
    state["fc.weight"], state["fc.bias"] = torch.zeros(1000, 512), torch.zeros(1000)
    path = tmp_path_factory.mktemp("weights") / "resnet18-0.pth"
    torch.save(state, path)
    return path


@pytest.fixture
def photos(tmp_path):
    rng = np.random.default_rng(0)
    folder = tmp_path / "photos"
    folder.mkdir()
    with (folder / "poses.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["file", "x", "y", "z"])
        for number in range(3):
            pixels = rng.integers(0, 255, (20, 30, 3), dtype=np.uint8)
            Image.fromarray(pixels).save(folder / f"{number}.png")
            writer.writerow([f"{number}.png", number, 1.0, 1.5])
    return folder


def test_views_of_a_mesh_are_those_of_the_box(grid):
    walls = {"all": {"absorption": 0.3}}
    room = RoomSpec.model_validate(
        {"name": "box", "size_m": (5.0, 4.0, 3.0), "surfaces": walls}
    )
    frame = replace(prepare(grid).frame, room=room)
    scene = Scene.of_geometry(MeshGeometry.box((5.0, 4.0, 3.0)), 0.3)
    box, mesh = BoxViews(frame), MeshViews(Shape.of_scene(scene))
    places = torch.tensor(grid.listeners.positions[:6]).float()
    rays = panorama_directions(7, 13).expand(6, -1, -1)
    for ours, theirs in zip(mesh(places, rays), box(places, rays), strict=True):
        assert_allclose(ours, theirs, rtol=1e-5, atol=1e-5)


def test_a_corner_of_an_l_shaped_room_hides_the_far_arm():
    shape = Shape.of_scene(load_scene("l-shaped"))
    views = MeshViews(shape)
    start = torch.tensor([[1.5, 4.0, 1.2]])
    depth, _ = views(start, torch.tensor([[[1.0, 0, 0], [0, -1.0, 0], [0, 0, 1.0]]]))
    assert_allclose(depth, [[1.5, 4.0, 1.8]], rtol=1e-5)


def test_the_shape_of_a_built_in_room_is_known_and_stored(grid):
    told = grid.responses[0:2], grid.emitters[:2], grid.listeners[:2]
    dataset = Dataset.from_arrays(
        *told, sample_rate=8000, metadata={"recipe": {"scene": "coupled"}}
    )
    shape = known_shape(dataset)
    assert shape is not None
    frame = prepare(dataset).frame
    again = SceneFrame.from_dict(frame.as_dict())
    assert_array_equal(again.shape.triangles, shape.triangles)
    # Bounce points lie on the surfaces: the furniture's tops among them.
    assert (np.abs(frame.surface_points[:, 2] - 0.75) < 1e-9).any()
    assert known_shape(grid) is None


def test_points_of_a_shape_lie_on_its_triangles():
    corners = np.array([[[0.0, 0, 0], [2, 0, 0], [0, 1, 0]]])
    points = Shape(corners, np.ones(1)).points(200, rng=np.random.default_rng(0))
    assert_allclose(points[:, 2], 0.0)
    assert (points[:, 0] / 2 + points[:, 1] <= 1 + 1e-12).all()
    assert_allclose(points.mean(axis=0), [2 / 3, 1 / 3, 0], atol=0.1)


def test_resnet_has_the_published_number_of_weights():
    count = sum(weight.numel() for weight in ResNet18().parameters())
    assert count == 11_689_512 - 513_000


def test_frozen_features_train_store_and_stay(grid, weights, tmp_path):
    config = {**SMALL, "features": "resnet18", "weights": str(weights)}
    field = train(grid, model="av-nerf", steps=2, config=config)
    stored = torch.load(weights, weights_only=True)
    kept = field.network.sight.network.state_dict()
    assert_array_equal(kept["layer4.1.conv2.weight"], stored["layer4.1.conv2.weight"])
    again = load_field(field.save(tmp_path / "field"))
    ends = grid.emitters[:3], grid.listeners[:3]
    assert_allclose(again.predict(*ends), field.predict(*ends), rtol=1e-5, atol=1e-7)


def test_missing_weights_are_one_clear_error(grid, monkeypatch, tmp_path):
    monkeypatch.setattr(torch.hub, "get_dir", lambda: str(tmp_path))
    with pytest.raises(MissingPartError, match="features=learned"):
        train(grid, model="av-nerf", steps=1, config={"features": "resnet18"})
    (tmp_path / "checkpoints").mkdir()
    wrong = tmp_path / "checkpoints" / "resnet18-1.pth"
    torch.save({"conv1.weight": torch.zeros(1)}, wrong)
    assert find_weights() == wrong
    with pytest.raises(MissingPartError, match="does not hold"):
        train(grid, model="av-nerf", steps=1, config={"features": "resnet18"})


def test_photographs_take_the_place_of_views(grid, photos, weights, tmp_path):
    config = {**SMALL, "photos": str(photos), "weights": str(weights)}
    field = train(grid, model="av-nerf", steps=2, config=config)
    assert isinstance(field.network.sight, PhotoSight)
    again = load_field(field.save(tmp_path / "field"))
    ends = grid.emitters[:3], grid.listeners[:3]
    assert_allclose(again.predict(*ends), field.predict(*ends), rtol=1e-5, atol=1e-7)


def test_photographs_are_read_with_their_poses(photos):
    found = read_photos(photos, size=16)
    assert found.images.shape == (3, 3, 16, 16)
    assert_allclose(found.poses.positions[2], [2.0, 1.0, 1.5])
    assert 0 <= found.images.min() < found.images.max() <= 1


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda folder: (folder / "poses.csv").unlink(), "no poses.csv"),
        (lambda folder: (folder / "1.png").unlink(), "1.png cannot be read"),
        (lambda folder: (folder / "1.png").write_text("x"), "1.png cannot be read"),
        (lambda folder: (folder / "poses.csv").write_text("file,x\n0.png,1"), "column"),
    ],
)
def test_mistakes_in_a_folder_of_photographs_are_told(photos, spoil, message):
    spoil(photos)
    with pytest.raises(DatasetError, match=message):
        read_photos(photos)

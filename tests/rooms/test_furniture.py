"""Furniture of a box: what stands in it, what it hides, what remains of the air."""

from dataclasses import replace

import numpy as np
import pytest

from rir import GainPattern, RoomSpec
from rir.errors import SceneError
from rooms import Scene, plan_effects, simulate
from rooms.builtin import load_scene
from rooms.furniture import Furniture
from rooms.presets import PRESETS, load_room

WALLS = {"all": {"absorption": 0.2, "scattering": 0.3}}
CUPBOARD = {"name": "cupboard", "low": (2.5, 0, 0), "high": (3.1, 2.5, 2.0)}


def room(*pieces: dict, **changes: object) -> RoomSpec:
    stated = {"name": "r", "size_m": (6, 5, 3), "surfaces": WALLS, "furniture": pieces}
    return RoomSpec.model_validate(stated | changes)


@pytest.mark.parametrize("name", PRESETS)
def test_a_furnished_mesh_encloses_the_air_that_furniture_leaves(name):
    spec = load_room(name)
    geometry = Scene.from_room(spec).furnished.geometry
    taken = sum(np.prod(np.subtract(b.high, b.low)) for b in spec.furniture)
    np.testing.assert_allclose(geometry.volume, spec.volume_m3 - taken)
    assert geometry.watertight
    assert geometry.mesh.panels.sided.all()


def test_only_what_touches_air_is_a_face():
    # 0.6 x 2.5 x 2.0 m against a wall and on the floor: no back, no foot
    geometry = Scene.from_room(room(CUPBOARD)).furnished.geometry
    areas = dict(zip(geometry.surface_names, geometry.areas, strict=True))
    np.testing.assert_allclose(areas["cupboard"], 2 * 2.5 * 2 + 0.6 * 2 + 0.6 * 2.5)
    np.testing.assert_allclose(areas["floor"], 6 * 5 - 0.6 * 2.5)
    np.testing.assert_allclose(areas["y0"], 6 * 3 - 0.6 * 2)


def test_pieces_that_overlap_or_almost_touch_are_one():
    one = {"name": "one", "low": (1, 1, 0), "high": (2, 2, 1)}
    two = {"name": "two", "low": (1.5, 1, 0), "high": (3, 2, 1)}
    near = {"name": "near", "low": (3.0004, 1, 0), "high": (4, 2, 1)}
    geometry = Scene.from_room(room(one, two, near)).furnished.geometry
    np.testing.assert_allclose(geometry.volume, 90 - 3)
    assert geometry.watertight
    pieces = np.isin(geometry.surface_names, ("one", "two", "near"))
    np.testing.assert_allclose(geometry.areas[pieces].sum(), 3 + 2 * 3 + 2)


def test_ways_through_a_piece_are_cut_and_grazing_ones_are_not():
    pieces = Furniture.of(room(CUPBOARD))
    assert pieces is not None
    starts = [[1, 1, 1], [1, 1, 1], [1, 2.5, 1], [1, 1, 2.9], [2.8, 3, 1]]
    ends = [[5, 1, 1], [1, 4, 1], [5, 2.5, 1], [5, 1, 2.9], [2.8, 2, 1]]
    expected = [True, False, False, False, True]
    assert pieces.cuts(starts, ends)[:, 0].tolist() == expected
    assert pieces.cuts(ends, starts)[:, 0].tolist() == expected


def test_a_cupboard_shades_the_direct_sound_and_little_the_lows():
    scene = Scene.from_room(room(CUPBOARD))
    ends = [1.5, 1.0, 1.2], [4.5, 1.0, 1.2]
    options = {"sample_rate": 16000, "duration": 0.02}
    shaded, free = (
        simulate(scene, *ends, effects=effects, **options).responses[0, 0]
        for effects in (["furniture", "direct", "diffraction"], ["direct"])
    )
    loss = [20 * np.log10(np.abs(np.fft.rfft(r)[[3, 80]])) for r in (free, shaded)]
    low, high = loss[0] - loss[1]
    assert 3 < low < high
    assert high > 15


def test_what_is_small_is_left_off_and_the_presets_are_furnished():
    vase = {"name": "vase", "low": (1, 1, 0), "high": (1.2, 1.2, 0.2)}
    options = {"sample_rate": 16000, "duration": 0.5}
    small = plan_effects(Scene.from_room(room(vase)), **options)
    assert "furniture" not in small.on
    kitchen = plan_effects(Scene.from_room(load_room("kitchen")), **options)
    assert {"furniture", "diffraction", "modes"} <= set(kitchen.on)
    assert "refrigerator (reflects 90 %" in kitchen.verdicts["furniture"].reason
    assert "assumed wooden" in kitchen.verdicts["furniture"].reason


def test_a_mixed_tail_is_shared_and_what_comes_before_is_not():
    # two rooms behind a door have a slope each; one has a single slope everywhere
    options = {"sample_rate": 8000, "duration": 0.3}
    scene = Scene.from_room(room(CUPBOARD))
    plan = plan_effects(scene, **options, only=None, without=["modes", "diffraction"])
    until = plan.work.traced_until
    assert 0.03 < until < 0.3
    places = [1.5, 1.0, 1.2], [[4.5, 1.0, 1.2], [1.2, 3.9, 1.6]]
    there = simulate(scene, *places, plan=plan, **options)
    back = simulate(scene, *places[::-1], plan=plan, **options)
    np.testing.assert_allclose(
        there.responses, back.responses.swapaxes(0, 1), atol=1e-12
    )
    fine = replace(plan, work=replace(plan.work, traced_until=np.inf, rays=20_000))
    whole = simulate(scene, *places, plan=fine, **options)
    n = round(until * 8000)
    ours, true = (
        [10 * np.log10(np.sum(r.responses[0, :, k] ** 2, axis=-1)) for k in _halves(n)]
        for r in (there, whole)
    )
    np.testing.assert_allclose(ours, true, atol=0.5)
    assert 0 < there.error_parts["order"]["reverberation_percent"] < 1
    far = plan_effects(load_scene("coupled"), **options, without=["modes"])
    assert far.work.traced_until == np.inf


def _halves(n: int) -> tuple[slice, slice]:
    return slice(0, n), slice(n, None)


def test_devices_keep_out_of_furniture():
    scene = Scene.from_room(room(CUPBOARD))
    with pytest.raises(SceneError, match="lies outside"):
        scene.check_inside("emitter", [2.8, 1, 1])


def test_a_piece_passes_at_most_what_two_faces_take_in():
    glass = CUPBOARD | {"absorption": 0.2, "transmission": 0.04}
    rows = Scene.from_room(room(glass)).furnished.transmission
    np.testing.assert_allclose(rows.max(axis=0), 0.2)
    with pytest.raises(SceneError, match="cupboard lets through more"):
        Scene.from_room(room(glass | {"transmission": 0.05}))


def test_many_emitters_and_one_listener_are_heard_as_one_emitter_by_many():
    scene = replace(
        Scene.from_room(room(CUPBOARD)), emitter_gain=GainPattern.cardioid()
    )
    turned = replace(
        scene, emitter_gain=scene.listener_gain, listener_gain=scene.emitter_gain
    )
    many, one = [[1.5, 1.0, 1.2], [4.0, 3.5, 1.5], [1.0, 4.0, 2.0]], [4.5, 1.0, 1.2]
    options = {
        "sample_rate": 8000, "duration": 0.05, "rays": 500,
        "effects": ["furniture", "patterns", "direct", "specular", "late", "modes"],
    }  # fmt: skip
    there = simulate(scene, many, one, **options).responses
    back = simulate(turned, one, many, **options).responses
    np.testing.assert_array_equal(there, np.swapaxes(back, 0, 1))
    alone = simulate(scene, many[0], one, **options).responses
    np.testing.assert_allclose(there[:1], alone, atol=1e-9 * np.abs(alone).max())

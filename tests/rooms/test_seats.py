"""Grazing sound over rows of seats: theory, published range, and what calls for it."""

from dataclasses import replace

import numpy as np
import pytest

from rir.errors import ConfigError
from rir.room import RoomSpec, SeatRows, Surface
from rir.walls import octave_frequencies, random_incidence_octaves
from rooms import Scene, plan_effects, simulate
from rooms.mesh import MeshGeometry
from rooms.reflection import Bounces, Reflection
from rooms.seating import OverSeats, Troughs, acting_depth, over_rows, troughs_of
from rooms.seating.over_seats import grazing_share

BANDS = 125.0 * 2.0 ** np.arange(7)
AUDIENCE = [0.39, 0.57, 0.80, 0.94, 0.92, 0.87, 0.85]
ROUGH = [0.3, 0.5, 0.6, 0.6, 0.7, 0.7, 0.7]
C = 343.0


def _hall(seats=None, **more):
    """Return a box of which the floor alone reflects."""
    rows = SeatRows() if seats is None else seats
    return Scene.shoebox(
        (40, 30, 20),
        absorption={"all": 1.0, "floor": AUDIENCE},
        scattering={"all": 0.0, "floor": ROUGH},
        seats=(None,) * 4 + (rows, None),
        **more,
    )


def _levels(scene, emitter, listeners, effects):
    """Return the energy per octave from 125 Hz to 1 kHz of a few responses."""
    made = simulate(
        scene, emitter, listeners, sample_rate=8000, duration=0.2, effects=effects
    )
    f = np.fft.rfftfreq(8192, 1 / 8000)
    power = np.abs(np.fft.rfft(made.responses[0], 8192)) ** 2
    octaves = [(f > c / 2**0.5) & (f < c * 2**0.5) for c in BANDS[:4]]
    return 10 * np.log10([power[:, some].sum(axis=1) for some in octaves]).T


def _excess(scene, emitter, listeners):
    on = _levels(
        scene, emitter, listeners, ("scattering", "seats", "direct", "specular")
    )
    return on - _levels(scene, emitter, listeners, ("direct",))


def test_rows_absorb_what_is_stated_of_sound_from_everywhere():
    for shares in (AUDIENCE, [0.1] * 7, [0.5] * 7):
        troughs = troughs_of(0.4, tuple(shares), tuple(BANDS), C)
        absorbed = random_incidence_octaves(troughs, BANDS)
        assert absorbed == pytest.approx(shares, abs=0.08)  # drag is interpolated


def test_troughs_without_loss_give_way_most_at_a_quarter_of_a_wave():
    troughs = Troughs(0.5, (1.0,), (0.0,), C)
    f = C / (4 * 0.5) * np.array([0.5, 1.5, 0.999])
    beta = troughs.admittance(f, np.ones(1))
    assert beta[:2] == pytest.approx([1j, -1j])
    assert abs(beta[2]) > 500


@pytest.mark.parametrize(("depth", "low", "high"), [(0.4, 100, 130), (0.7, 60, 85)])
def test_dip_lies_where_troughs_are_a_quarter_of_a_wave(depth, low, high):
    f = np.arange(40.0, 400.0, 2.0)
    troughs = Troughs(depth, (1.0,), (200.0,), C)
    ends = np.array([1.5]), np.array([0.4])
    level = np.abs(1 + over_rows(troughs, f, ends, np.array([15.0]))[0])
    center = f[np.argmin(level)]
    assert low < center < high
    assert center < C / (4 * depth)


def test_published_range_in_a_hall():
    # over ten to twenty rows, 1 to 8 degrees above them
    listeners = [[d, 15, 1.2] for d in (13.0, 18.0, 25.0)]
    grazing = _excess(_hall(), [3, 15, 2.3], listeners)
    assert np.all((grazing[:, 0] < -9) & (grazing[:, 0] > -20))
    assert np.all((grazing[:, 1:3] < 0) & (grazing[:, 1:3] > -11))
    assert np.all(np.abs(grazing[:, 3]) < 4)
    # 20 to 40 degrees above them
    steep = _excess(_hall(), [3, 15, 2.3], [[9, 15, 6.0], [13, 15, 9.0]])
    assert np.all(np.abs(steep) < 4)


def test_pair_of_paths_has_the_energy_of_the_spherical_wave():
    run = np.array([6.0, 12.0, 20.0])
    listeners = [[3 + d, 15, 1.2] for d in run]
    scene = _hall()
    depth, c = acting_depth(0.8, 0.3), scene.speed_of_sound
    troughs = troughs_of(depth, tuple(AUDIENCE), tuple(BANDS), c)
    f = octave_frequencies(BANDS)
    image = over_rows(troughs, f.ravel(), (np.full(3, 1.5), np.full(3, 0.4)), run)
    energy = np.mean(np.abs(1 + image).reshape(3, *f.shape) ** 2, axis=2)
    wanted = 10 * np.log10(energy)[:, :3]
    found = _excess(scene, [3, 15, 2.3], listeners)[:, :3]
    # octaves of a list of paths overlap, and rows are rough
    assert found[:, 1:] == pytest.approx(wanted[:, 1:], abs=2.0)
    # what echoes cancel they cancel to a fifth
    assert np.all(found[:, 0] < np.maximum(wanted[:, 0] + 3, -10.5))


def test_roughness_vanishes_at_grazing_and_keeps_its_mean():
    x, w = np.polynomial.legendre.leggauss(32)
    cosine = (x + 1) / 2
    for mean in (0.1, 0.5, 0.8):
        share = grazing_share(np.full((32, 1), mean), cosine, np.zeros(1))[:, 0]
        assert np.sum(w * cosine * share) == pytest.approx(mean, abs=0.01)
        assert grazing_share(np.full((1, 1), mean), np.zeros(1), np.zeros(1)) == 0


def test_exchange_changes_nothing_in_boxes_and_meshes():
    one, other = [3, 14, 2.3], [20, 16, 1.2]
    box = _hall()
    mesh = Scene.of_geometry(
        box.geometry.mesh,
        {
            "floor": {
                "absorption": AUDIENCE,
                "scattering": ROUGH,
                "seats": {"drawn_at": "floor"},
            },
            "all": {"absorption": 1.0},
        },
    )
    effects = ("scattering", "seats", "direct", "specular")
    made = []
    for scene in (box, mesh):
        there, back = (
            simulate(
                scene, *ends, sample_rate=8000, duration=0.2, effects=effects
            ).responses[0, 0]
            for ends in ((one, other), (other, one))
        )
        assert np.linalg.norm(there - back) < 1e-6 * np.linalg.norm(there)
        made.append(there)
    assert np.linalg.norm(made[0] - made[1]) < 1e-5 * np.linalg.norm(made[0])


def test_means_over_a_panel_stay_as_they_are():
    scene = _hall()
    one = np.ones(1)
    change = OverSeats(scene, np.arange(6) == 4)
    kept = Reflection(np.full((1, 7), 0.5), np.full((1, 7), 0.2))
    nowhere = np.full((1, 3), np.nan)
    floor = np.array([4])
    mean = Bounces(floor, floor, 0.1 * one, 9 * one, 9 * one, nowhere)
    assert change(kept, mean) is kept
    single = Bounces(floor, floor, 0.1 * one, 9 * one, 9 * one, np.zeros((1, 3)))
    assert change(kept, single).pressure[0, 0] < 0


def test_floors_under_seats_and_their_tops_sound_alike():
    tops = SeatRows(drawn_at="tops")
    drawn_floor = _excess(_hall(), [3, 15, 2.3], [[18, 15, 1.2]])
    drawn_tops = _excess(_hall(tops), [3, 15, 1.5], [[18, 15, 0.4]])
    assert drawn_floor == pytest.approx(drawn_tops, abs=1.0)


def test_who_marks_seats():
    assert Surface(material="audience_on_upholstered_seats").seat_rows == SeatRows()
    unmarked = Surface.model_validate(
        {"material": "audience_on_upholstered_seats", "seats": False}
    )
    assert unmarked.seat_rows is None
    assert Surface(material="brick").seat_rows is None
    marked = Surface.model_validate({"absorption": 0.5, "seats": True})
    assert marked.seat_rows == SeatRows()
    with pytest.raises(ValueError, match=r"under_m 0\.9 must be less"):
        SeatRows(back_m=0.8, under_m=0.9)


def test_room_files_mark_seats(tmp_path):
    path = tmp_path / "hall.yaml"
    path.write_text(
        "name: hall\nsize_m: [30, 20, 10]\nsurfaces:\n"
        "  floor: {absorption: 0.6, seats: {back_m: 1.0}}\n  all: {absorption: 0.2}\n"
    )
    scene = Scene.from_room(RoomSpec.load(path))
    assert [rows and rows.back_m for rows in scene.seats] == [None] * 4 + [1.0, None]
    path.write_text(path.read_text().replace("back_m", "backs"))
    with pytest.raises(ConfigError, match="backs"):
        RoomSpec.load(path)


def test_names_of_layers_mark_seats_and_are_told():
    lot = [[0, 0], [20, 0], [20, 12], [0, 12]]
    geometry = MeshGeometry.extruded(np.array(lot, float), 6.0)
    others = geometry.surface_names[1:]
    renamed = replace(geometry, surface_names=("Audience_2", *others))
    scene = Scene.of_geometry(renamed, {"all": 0.3})
    assert [rows and rows.back_m for rows in scene.seats] == [0.8] + [None] * 5
    assert "Audience_2: taken for rows of seats by name" in "".join(scene.remarks)
    assert plan_effects(scene).verdicts["seats"].on
    stated = {"Audience_2": {"absorption": 0.3, "seats": False}, "all": 0.3}
    scene = Scene.of_geometry(renamed, stated)
    assert not any(scene.seats)
    assert "rows of seats" not in "".join(scene.remarks)


def test_planner_asks_for_seats_only_where_they_are():
    plain = Scene.shoebox((6, 5, 3))
    need = plan_effects(plain).verdicts["seats"]
    assert not need.on
    assert need.reason == "no surface is marked as seats"
    need = plan_effects(_hall()).verdicts["seats"]
    assert need.on
    assert "1200 m² of seats change what grazes them by" in need.reason
    bench = Scene.shoebox(
        (3, 1.5, 3), absorption=0.5, seats=(None,) * 4 + (SeatRows(), None)
    )
    need = plan_effects(bench).verdicts["seats"]
    assert not need.on
    assert need.reason == "no surface marked as seats is level and 4 rows long"

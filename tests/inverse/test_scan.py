import numpy as np
from numpy.testing import assert_allclose

from inverse.rows.direct import read_direct
from inverse.rows.fitset import FitSet
from inverse.walls.box import assemble_boxes
from inverse.walls.scan import scan_planes, scan_signals

TRUE_OFFSETS = np.array([0.0, -5.0, 0.0, -4.0, 0.0, -2.8])


def found_in(rows):
    signals = scan_signals(rows.spread(120), read_direct(rows))
    return signals, scan_planes(signals)


def test_direct_sound_tells_latency_and_shape(make_box_rows):
    rows = make_box_rows(emitters=3, listeners=20, latency=40)
    direct = read_direct(rows)
    assert_allclose(direct.latency_s * rows.sample_rate, 40, atol=1)
    assert direct.clearness > 20


def test_walls_are_found_blind(box_set):
    signals, found = found_in(box_set)
    box = assemble_boxes(signals, found)[0]
    assert box.found.all()
    assert_allclose(box.planes[:, 3], TRUE_OFFSETS, atol=0.008)
    tilt = np.degrees(np.arccos(np.clip(np.diag(box.axes), -1, 1)))
    assert (tilt < 0.5).all()


def test_noise_holds_no_walls(box_set):
    rng = np.random.default_rng(2)
    noise = FitSet(
        rng.standard_normal(box_set.responses.shape),
        box_set.emitters,
        box_set.listeners,
        box_set.sample_rate,
        box_set.speed_of_sound,
        box_set.places,
        box_set.blocks,
    )
    assert read_direct(noise).clearness < 4
    signals, found = found_in(noise)
    assert assemble_boxes(signals, found) == []

"""Physics of the shoebox: closed forms, conservation, reciprocity, hard cases."""

import numpy as np
import pytest

from rir import GainPattern, Pose, Poses
from rir.errors import SceneError, SignalError
from rir.room import Air
from rooms import Scene, simulate

SIZE = np.array([6.0, 5.0, 3.0])
A, B = Pose.at(1.7, 3.1, 1.4, 20, 5), Pose.at(4.1, 1.3, 1.9, 130, -10)
BANDED = [0.10, 0.12, 0.15, 0.20, 0.22, 0.25, 0.30]


def images(order, emitter, listener):
    """List every image one by one: distance, wall counts, arrival, departure."""
    found = []
    for i in range(-order, order + 1):
        for j in range(-order, order + 1):
            for k in range(-order, order + 1):
                index = np.array([i, j, k])
                if abs(index).sum() > order:
                    continue
                odd = index % 2 != 0
                place = index * SIZE + np.where(odd, SIZE - emitter, emitter)
                way = place - listener
                unit = way / np.linalg.norm(way)
                more, fewer = (abs(index) + 1) // 2, abs(index) // 2
                near = np.where(index > 0, fewer, more)
                far = np.where(index > 0, more, fewer)
                departure = np.where(odd, unit, -unit)
                counts = np.stack([near, far], axis=1).ravel()
                found.append((np.linalg.norm(way), counts, unit, departure))
    return found


def test_image_count_of_an_order():
    order = 3
    scene = Scene.shoebox(SIZE, absorption=0.0)
    result = simulate(
        scene, A, B, sample_rate=16000, duration=0.2, max_order=order,
        effects=["direct", "specular"],
    )  # fmt: skip
    expected = (2 * order + 1) * (2 * order**2 + 2 * order + 3) // 3
    found = images(order, A.position, B.position)
    assert len(found) == expected
    total = sum(1 / distance for distance, *_ in found)
    np.testing.assert_allclose(result.responses.sum(), total, rtol=1e-4)


@pytest.mark.parametrize("patterned", [False, True])
def test_every_image_arrives_where_and_as_strong_as_it_must(patterned):
    order, rate = 4, 16000
    emit, hear = GainPattern.cardioid(), GainPattern.first_order(0.3)
    walls = np.linspace(0.05, 0.4, 6)[:, None] * np.linspace(0.5, 1.5, 7)
    scene = Scene.shoebox(
        SIZE,
        absorption=walls,
        emitter_gain=emit if patterned else None,
        listener_gain=hear if patterned else None,
    )
    result = simulate(
        scene, A, Poses.of([B]), sample_rate=rate, duration=0.2, max_order=order,
        effects=["direct", "specular", "patterns"],
    )  # fmt: skip
    # at the centre of an octave only its own band speaks
    f, band = 1000.0, 3
    n = np.arange(result.responses.shape[-1])
    measured = result.responses[0, 0] @ np.exp(-2j * np.pi * f * n / rate)
    expected = 0j
    for distance, counts, arrival, departure in images(order, A.position, B.position):
        gain = np.prod(np.sqrt(1 - walls[:, band]) ** counts) / distance
        if patterned:
            gain *= emit.gain(A.to_local(departure))[0]
            gain *= hear.gain(B.to_local(arrival))[0]
        expected += gain * np.exp(-2j * np.pi * f * distance / scene.speed_of_sound)
    assert abs(measured - expected) < 2e-5 * abs(expected)


def test_pulses_are_exact_in_band():
    rate, n = 16000, 400
    scene = Scene.shoebox((60, 50, 40), absorption=1.0)
    f = np.linspace(50, 0.8 * rate / 2, 200)
    for step in np.linspace(0, 1, 7):
        far = 1.0 + step * scene.speed_of_sound / rate
        ends = Pose.at(30, 20, 20), Pose.at(30 + far, 20, 20)
        run = {"sample_rate": rate, "duration": n / rate, "effects": ["direct"]}
        response = simulate(scene, *ends, **run)
        samples = response.responses[0, 0]
        spectrum = np.exp(-2j * np.pi * f[:, None] * np.arange(n) / rate) @ samples
        exact = np.exp(-2j * np.pi * f * far / scene.speed_of_sound) / far
        assert np.max(np.abs(spectrum - exact)) * far < 10 ** (-93 / 20)


def test_a_rigid_box_is_its_modal_sum():
    """Images and modes describe the same box: difference below -110 dB.

    Both are seen through a smooth low-pass, away from the start where the images
    of a finite list are complete.
    """
    from scipy.fft import irfft, rfft, rfftfreq

    rate, duration = 2000, 0.5
    scene = Scene.shoebox(SIZE, absorption=0.0)
    h = simulate(
        scene, A, B, sample_rate=rate, duration=duration,
        effects=["direct", "specular"],
    ).responses[0, 0]  # fmt: skip
    c, n = scene.speed_of_sound, len(h)
    f = rfftfreq(8 * n, 1 / rate)
    low_pass = np.exp(-((f / 110.0) ** 2) * np.log(2) * 3)
    seen = np.asarray(irfft(np.asarray(rfft(h, 8 * n)) * low_pass, 8 * n))[:n]
    t = np.arange(n) / rate
    # 4 pi p, with p'' + w^2 p = c^2 phi(s) phi(r) / Lambda d(delta)/dt ... in time:
    # h(t) = (4 pi c^2 / V) sum phi phi e sin(w t)/w
    modal = np.zeros(n)
    orders = [np.arange(int(2 * 600 * L / c) + 2) for L in SIZE]
    for i in orders[0]:
        for j in orders[1]:
            for k in orders[2]:
                index = np.array([i, j, k])
                w = np.pi * c * np.sqrt(np.sum((index / SIZE) ** 2))
                frequency = w / (2 * np.pi)
                if frequency > 600:
                    continue
                shape = np.cos(np.pi * index * A.position / SIZE) * np.cos(
                    np.pi * index * B.position / SIZE
                )
                weight = np.prod(np.where(index > 0, 2.0, 1.0) * shape)
                gain = np.exp(-((frequency / 110.0) ** 2) * np.log(2) * 3)
                wave = t if w == 0 else np.sin(w * t) / w
                modal += weight * gain * wave
    modal *= 4 * np.pi * c**2 / np.prod(SIZE) / rate
    inside = (t > 0.11) & (t < 0.35)
    # the cut at the response's end and the rising mean reach back a few ms only
    error = np.linalg.norm((seen - modal)[inside]) / np.linalg.norm(modal[inside])
    assert 20 * np.log10(error) < -110


@pytest.mark.parametrize("scattering", [0.0, 0.1, 0.3, 0.9])
def test_scattering_neither_makes_nor_loses_energy(scattering):
    from rooms.energy_flow import energy_flow

    scene = Scene.shoebox(SIZE, absorption=0.0, scattering=scattering)
    times = np.linspace(0.001, 0.5, 50)
    for order in (None, 0, 3, 10):
        flow = energy_flow(scene, times, scattering=scene.scattering, max_order=order)
        total = flow.images + flow.beyond + flow.scattered
        lossless = 4 * np.pi * scene.speed_of_sound / scene.geometry.volume
        np.testing.assert_allclose(10 * np.log10(total / lossless), 0, atol=0.05)


@pytest.mark.parametrize("scattering", [0.0, 0.2, 0.6])
def test_rendered_energy_is_that_of_the_closed_form(scattering):
    scene = Scene.shoebox(SIZE, absorption=0.0, scattering=scattering)
    places = np.random.default_rng(1).uniform(0.2, 0.8, (6, 2, 3)) * SIZE
    energy = []
    for a, b in places:
        h = simulate(
            scene, a, b, sample_rate=8000, duration=0.35,
            effects=["direct", "specular", "scattering", "late"],
        ).responses[0, 0, 800:]  # fmt: skip
        # images that are all positive pile up at 0 Hz: look above 1 kHz, where
        # they add as energies
        spectrum = abs(np.fft.rfft(h * np.hanning(len(h)))) ** 2
        above = spectrum[len(spectrum) // 4 : -len(spectrum) // 5]
        energy.append(above.mean() / np.sum(np.hanning(len(h)) ** 2))
    lossless = 4 * np.pi * scene.speed_of_sound / scene.geometry.volume / 8000
    assert abs(10 * np.log10(np.mean(energy) / lossless)) < 0.5


def test_exchange_of_ends_and_patterns_is_exact():
    emit, hear = GainPattern.cardioid(), GainPattern.first_order(0.25)
    options = {"absorption": BANDED, "scattering": 0.3}
    there = Scene.shoebox(SIZE, emitter_gain=emit, listener_gain=hear, **options)
    back = Scene.shoebox(SIZE, emitter_gain=hear, listener_gain=emit, **options)
    run = {"sample_rate": 16000, "duration": 0.3}
    forward = simulate(there, A, B, **run).responses[0, 0]
    reverse = simulate(back, B, A, **run).responses[0, 0]
    error = np.linalg.norm(forward - reverse) / np.linalg.norm(forward)
    assert error < 10 ** (-120 / 20)


def test_air_absorption_follows_iso_9613():
    far, rate = 30.0, 16000
    scene = Scene.shoebox((60, 50, 40), absorption=1.0, air=Air(humidity_percent=30))
    ends = Pose.at(10, 20, 20), Pose.at(10 + far, 20, 20)
    h = simulate(
        scene, *ends, sample_rate=rate, duration=0.12, effects=["direct", "air"]
    ).responses[0, 0]
    for f, loss in ((1000, 5.01), (2000, 14.1), (4000, 48.9)):
        spectrum = abs(h @ np.exp(-2j * np.pi * f * np.arange(len(h)) / rate)) * far
        np.testing.assert_allclose(
            -20 * np.log10(spectrum), loss * far / 1000, rtol=0.02
        )


def test_threads_and_batches_change_nothing():
    scene = Scene.shoebox(SIZE, absorption=BANDED, scattering=0.2)
    places = Poses(np.random.default_rng(2).uniform(0.5, 2.5, (20, 3)))
    run = {"sample_rate": 8000, "duration": 0.1}
    one = simulate(scene, A, places, **run).responses
    two = simulate(scene, A, places, threads=2, **run).responses
    np.testing.assert_array_equal(one, two)
    single = simulate(scene, A, places[7], **run).responses
    np.testing.assert_array_equal(single[0, 0], one[0, 7])


def test_bands_that_are_one_sound_as_if_they_were_not():
    run = {"sample_rate": 16000, "duration": 0.2}
    run["effects"] = ["direct", "specular", "scattering", "late"]
    made = []
    for least in (0.0, 1e-9):
        walls = np.full((6, 7), 0.2) + least * np.arange(7)
        scene = Scene.shoebox(SIZE, absorption=walls, scattering=0.3)
        made.append(simulate(scene, A, B, **run).responses[0, 0])
    # where a response ends, filters of single bands ring
    one, apart = (response[:-40] for response in made)
    assert np.linalg.norm(one - apart) < 10 ** (-100 / 20) * np.linalg.norm(apart)


@pytest.mark.parametrize(
    ("size", "rate"), [((0.01, 0.01, 0.01), 48000), ((100, 90, 80), 8000),
                       ((6, 5, 3), 192000), ((0.3, 80, 3), 16000)],
)  # fmt: skip
@pytest.mark.parametrize("absorption", [0.0, 0.3, 1.0])
def test_hard_rooms_stay_finite(size, rate, absorption):
    scene = Scene.shoebox(size, absorption=absorption, scattering=0.2)
    ends = np.array(size) * 0.3, np.array(size) * [0.3, 0.0, 0.9]
    duration = 0.002 if size[0] < 1 else 0.1
    result = simulate(scene, *ends, sample_rate=rate, duration=duration)
    assert np.isfinite(result.responses).all()


def test_coincident_ends_and_zero_gain_stay_finite():
    dipole = GainPattern.first_order(0.0)
    scene = Scene.shoebox(SIZE, emitter_gain=dipole, scattering=0.1)
    side = Pose.at(2, 2, 1), Pose.at(2, 3, 1)
    for ends in ((A, A), side):
        h = simulate(scene, *ends, sample_rate=8000, duration=0.05).responses
        assert np.isfinite(h).all()


def test_mistakes_are_told():
    scene = Scene.shoebox(SIZE)
    with pytest.raises(SceneError, match="emitter .* outside"):
        simulate(scene, [7, 1, 1], B, sample_rate=8000, duration=0.1)
    with pytest.raises(SignalError, match="above 0"):
        simulate(scene, A, B, sample_rate=8000, duration=0.0)
    with pytest.raises(SceneError, match="0…1"):
        Scene.shoebox(SIZE, absorption=1.2)
    with pytest.raises(SceneError, match="fits neither"):
        Scene.shoebox(SIZE, absorption=[0.1, 0.2, 0.3])
    with pytest.raises(SceneError, match="three positive lengths"):
        Scene.shoebox((1, 2))


def reverberation(scene, count=10, rate=8000, duration=0.7):
    """Return T (-5 to -35 dB) of the energy above 1 kHz, summed over places [s]."""
    places = np.random.default_rng(7).uniform(0.15, 0.85, (count, 2, 3)) * SIZE
    from scipy.signal import butter, sosfilt

    high = butter(4, 1000, "highpass", fs=rate, output="sos")
    energy = np.zeros(round(rate * duration))
    for seed, (a, b) in enumerate(places):
        h = simulate(
            scene, a, b, sample_rate=rate, duration=duration, seed=seed,
            effects=["direct", "specular", "scattering", "late"],
        ).responses[0, 0]  # fmt: skip
        energy += np.asarray(sosfilt(high, h)) ** 2
    curve = np.cumsum(energy[::-1])[::-1]
    level = 10 * np.log10(curve / curve[0])
    inside = (level < -5) & (level > -35)
    times = np.arange(len(level))[inside] / rate
    return -60 / np.polyfit(times, level[inside], 1)[0]


def test_eyring_holds_where_surfaces_scatter_and_only_there():
    eyring = 0.515
    mixed = reverberation(Scene.shoebox(SIZE, absorption=0.2, scattering=0.6))
    np.testing.assert_allclose(mixed, eyring, rtol=0.05)
    mirrors = reverberation(Scene.shoebox(SIZE, absorption=0.2, scattering=0.0))
    assert 0.59 < mirrors < 0.68

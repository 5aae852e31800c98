"""Effects that change a bounce or an arrival: one chain, asked by every engine."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from rir import Pose, Poses
from rooms import Scene
from rooms.box_images import box_paths
from rooms.mesh import MeshGeometry, find_paths
from rooms.plan import plan_effects
from rooms.reflection import Reflection
from rooms.simulation import run_plan
from rooms.sound import Budget, Sound

SIZE = np.array([6.0, 5.0, 3.0])
EMITTER = np.array([1.7, 3.1, 1.4])
LISTENERS = np.array([[4.0, 1.0, 2.0], [0.4, 4.6, 0.3]])
OUTLINE = [(0, 0), (4, 0), (4, 1.6), (2, 1.6), (2, 3), (0, 3)]


@dataclass(frozen=True)
class Grazing:
    """Surfaces that keep less of sound at normal incidence; local by its nature."""

    strength: float
    local: bool = True

    def __call__(self, reflection, bounces):
        factor = 1 - self.strength * bounces.cosine[:, None]
        return Reflection(reflection.pressure * factor, reflection.scattered)


def _responses(scene, strength=None, listen=None, only=("direct", "specular")):
    emitter = Pose.at(0.7, 2.3, 1.1) if listen is None else Pose.at(*listen)
    listener = Poses.of(
        [Pose.at(3.1, 0.9, 1.5) if listen is None else Pose.at(0.7, 2.3, 1.1)]
    )
    sound = Sound(scene, emitter, listener, Budget(16000, 1600, 6))
    if strength is not None:
        sound.bounce_changes.append(Grazing(strength))
    plan = plan_effects(scene, only=list(only), sample_rate=16000, duration=0.1)
    return run_plan(scene, plan, sound)[0]


def _rooms():
    return [
        Scene.shoebox((4, 3, 2.5), absorption=0.3),
        Scene.extruded(OUTLINE, 2.5, 0.3),
    ]


@pytest.mark.parametrize("scene", _rooms(), ids=["box", "mesh"])
def test_a_change_that_changes_nothing_changes_nothing(scene):
    plain, changed = _responses(scene), _responses(scene, 0.0)
    assert np.linalg.norm(changed - plain) < 1e-9 * np.linalg.norm(plain)


@pytest.mark.parametrize("scene", _rooms(), ids=["box", "mesh"])
def test_a_change_takes_energy_and_is_reciprocal(scene):
    there, back = (_responses(scene, 0.5, listen) for listen in (None, (3.1, 0.9, 1.5)))
    assert np.sum(there**2) < np.sum(_responses(scene) ** 2)
    assert np.linalg.norm(there - back) < 1e-10 * np.linalg.norm(there)


def test_first_reflection_asks_with_its_own_angle():
    scene = Scene.shoebox((40, 40, 40), absorption=[0.0] * 7)
    absorbing = dict.fromkeys(("x0", "x1", "y0", "y1", "ceiling"), 1.0)
    scene = replace(
        scene,
        absorption=Scene.shoebox(
            (40, 40, 40), absorption={**absorbing, "floor": 0.0}
        ).absorption,
    )
    sound = Sound(
        scene, Pose.at(20, 20, 3), Poses.of([Pose.at(24, 20, 3)]), Budget(16000, 1600)
    )
    sound.bounce_changes.append(Grazing(0.5))
    plan = plan_effects(scene, only=["specular"], sample_rate=16000, duration=0.1)
    run_plan(scene, plan, sound)
    way = np.hypot(4, 6)
    (arrivals,) = sound.arrivals
    floor = np.argmin(np.abs(arrivals.delay * scene.speed_of_sound - way))
    assert arrivals.gain[floor] == pytest.approx((1 - 0.5 * 6 / way) / way)
    assert arrivals.corners is not None
    assert arrivals.corners[floor, 0] == pytest.approx([22, 20, 0])


def test_paths_of_a_box_are_those_of_its_mesh():
    listed = box_paths(SIZE, EMITTER, LISTENERS, 3)
    room = MeshGeometry.box(SIZE)
    # the mesh stands where the box stands: a corner at the origin
    found = find_paths(room, EMITTER, LISTENERS, max_order=3, direct=False)
    rows, bounces = found.bounces(room, EMITTER)
    assert len(listed) == len(found) == 2 * 62
    assert np.sort(listed.length) == pytest.approx(np.sort(found.length), abs=1e-9)

    def described(length, rows, b):
        key = np.column_stack([length[rows], b.before, b.after, b.cosine, b.point])
        return key[np.lexsort(np.round(key, 6).T)]

    ours = described(listed.length, listed.rows, listed.bounces)
    theirs = described(found.length, rows, bounces)
    assert ours == pytest.approx(theirs, abs=1e-6)
    whole = listed.bounces.before + listed.bounces.after
    assert whole == pytest.approx(listed.length[listed.rows])


def test_mean_over_a_diffuse_field_weighs_by_the_cosine():
    scene = Scene.shoebox(SIZE, absorption=0.0)
    sound = Sound(
        scene, Pose.at(1, 1, 1), Poses.of([Pose.at(2, 2, 2)]), Budget(16000, 160)
    )
    sound.bounce_changes.append(Grazing(1.0))
    # 2 ∫ (1 - c)² c dc = 1/6
    assert sound.absorption == pytest.approx(np.full((6, 7), 5 / 6))


def test_changes_of_arrivals_come_before_rendering():
    scene = Scene.shoebox(SIZE, absorption=0.3)
    sound = Sound(
        scene, Pose.at(1, 1, 1), Poses.of([Pose.at(3, 2, 2)]), Budget(16000, 800)
    )
    sound.arrival_changes.append(
        lambda arrivals: replace(arrivals, gain=0 * arrivals.gain)
    )
    plan = plan_effects(
        scene,
        only=["direct", "specular"],
        max_order=3,
        sample_rate=16000,
        duration=0.05,
    )
    sound.budget = Budget(16000, 800, 3)
    assert not np.any(run_plan(scene, plan, sound))


def test_nothing_is_asked_of_changes_where_nothing_is_reflected():
    scene = Scene.extruded(OUTLINE, 2.5, 0.3)
    emitter, listeners = Pose.at(0.7, 2.3, 1.1), Poses.of([Pose.at(0.9, 0.9, 1.5)])
    sound = Sound(scene, emitter, listeners, Budget(16000, 1600, 0))
    sound.bounce_changes.append(Picky())
    plan = plan_effects(
        scene, only=["direct", "specular"], sample_rate=16000, duration=0.1
    )
    assert np.count_nonzero(run_plan(scene, plan, sound)[0] > 0.1) > 0


class Picky:
    """A change that looks at the first reflection."""

    local = True

    def __call__(self, reflection, bounces):
        assert bounces.cosine[0] >= 0
        return reflection

"""Small rendered views of crosses, shared by the tests of trocars."""

from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

from glisson.core.camera import Camera
from glisson.core.crosses import Cross, CrossLayout
from glisson.core.room import HangingArea, Room
from glisson.core.transform import RigidTransform
from glisson.intraoperative.trocar.codes import cross_codes
from glisson.phantom.photograph import Sensor
from glisson.phantom.room_scene import bare_scene
from glisson.phantom.room_view import RoomViews

CAMERA = Camera(640, 480, [400.0, 402.0], [318.0, 241.0], [-0.06, 0.01, 5e-4, -3e-4, 0.0])
ROOM = Room(
    [6000.0, 5000.0, 2900.0],
    (HangingArea("ceiling", [0.0, 0.0, 2900.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 5000.0, 4000.0),),
    [-200.0, -200.0, 1000.0],
    [200.0, 200.0, 1100.0],
    np.deg2rad(15.0),
)
MIDDLES = [(-700.0, -500.0), (700.0, -450.0), (0.0, 0.0), (-650.0, 550.0), (600.0, 500.0)]


def layout(count=5, size_mm=400.0):
    crosses = []
    for n in range(count):
        turned = Rotation.from_euler("z", 0.4 * n).as_matrix()
        pose = RigidTransform("room", "cross", turned, [*MIDDLES[n], 2900.0])
        crosses.append(Cross(f"cross {n + 1}", cross_codes()[n], size_mm, pose))
    return CrossLayout(tuple(crosses))


def pose(seed):
    return ROOM.draw_pose(np.random.default_rng(seed))


@cache
def views():
    return RoomViews(CAMERA)


def view(crosses, room_from_trocar, seed=0, gamma=1.0):
    rng = np.random.default_rng(seed)
    return views().view(bare_scene(ROOM, crosses), room_from_trocar, Sensor(), rng, gamma)

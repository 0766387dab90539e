"""What stands and hangs in a rendered room: crosses, lamps, people, and coloured things that are no crosses."""

from dataclasses import dataclass, replace

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.crosses import BOARD_SHARE, CrossLayout
from glisson.core.room import HangingArea, Room
from glisson.core.transform import RigidTransform

INKS = {
    "red": (0.75, 0.08, 0.10),
    "yellow": (0.88, 0.74, 0.06),
    "green": (0.06, 0.48, 0.20),
    "blue": (0.07, 0.20, 0.62),
}
"""What printed colours reflect of red, green and blue light."""

PAPER = (0.88, 0.88, 0.86)


@dataclass(frozen=True)
class Patch:
    """A sheet: with `cross_mm` > 0 a cross of that size in its middle.

    `colours` (6, 3) are those of the paper, and of the cross in the order of `Cross.colours`.
    """

    centre_mm: FloatArray
    right: FloatArray
    down: FloatArray
    half_mm: tuple[float, float]
    cross_mm: float
    colours: FloatArray


@dataclass(frozen=True)
class Scene:
    """A room with all that is seen in it.

    Args:
        size_mm: of the box (3,), as `Room`.
        wall_colours: (6, 3) of what is met at least x, largest x, least y, largest y, floor and ceiling.
        patches: sheets on the walls and the ceiling, the later ones over the earlier.
        rods: (n, 7) two ends and radius of round things, mm.
        rod_colours: (n, 3); above 1 it shines.
        gradient: (3,) relative change of the light per mm.
        tint: (3,) colour of the light times exposure.
        glare: (n, 5) place, radius (mm) and strength of reflections of lamps.
    """

    size_mm: FloatArray
    wall_colours: FloatArray
    patches: tuple[Patch, ...]
    rods: FloatArray
    rod_colours: FloatArray
    gradient: FloatArray
    tint: FloatArray
    glare: FloatArray


def bare_scene(room: Room, layout: CrossLayout) -> Scene:
    """The crosses in an empty white room under even light."""
    patches = []
    for cross in layout.crosses:
        side = cross.size_mm * BOARD_SHARE / 2.0
        pose = cross.room_from_cross
        colours = np.array([PAPER, *(INKS[name] for name in cross.colours)])
        patches.append(
            Patch(pose.translation_mm, pose.rotation[:, 0], pose.rotation[:, 1], (side, side), cross.size_mm, colours)
        )
    nothing = np.zeros((0, 7))
    return Scene(
        room.size_mm, np.full((6, 3), 0.7), tuple(patches), nothing, nothing[:, :3], np.zeros(3), np.ones(3),
        np.zeros((0, 5)),
    )  # fmt: skip


def draw_scene(room: Room, layout: CrossLayout, room_from_camera: RigidTransform, rng: np.random.Generator) -> Scene:
    """A room in use: light, colours, lamps, arms, people and false crosses are drawn."""
    bare = bare_scene(room, layout)
    walls = rng.uniform(0.45, 0.8, (6, 1)) * rng.uniform(0.9, 1.0, (6, 3))
    rods, rod_colours = _rods(room, room_from_camera, rng)
    warm = rng.uniform(-0.15, 0.15)
    return replace(
        bare,
        wall_colours=walls,
        patches=(*_false_patches(room, layout, rng), *bare.patches),
        rods=rods,
        rod_colours=rod_colours,
        gradient=rng.normal(size=3) * [6e-5, 6e-5, 0.0],
        tint=rng.uniform(0.5, 1.0) * np.array([1.0 + warm, 1.0, 1.0 - warm]),
        glare=_glare(bare, rng),
    )


def _rods(room: Room, room_from_camera: RigidTransform, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Two lamps on arms, up to three people bent over the table, and the instrument in the trocar."""
    rods, colours = [], []
    ceiling = room.size_mm[2]
    for _ in range(2):
        lamp = np.array([*rng.uniform(-1100.0, 1100.0, 2), rng.uniform(0.68, 0.78) * ceiling])
        joint = np.array([lamp[0] * 0.3, lamp[1] * 0.3, ceiling])
        rods += [[*lamp, *lamp, rng.uniform(120.0, 220.0)], [*lamp, *joint, 35.0]]
        colours += [(1.6, 1.6, 1.5), (0.55, 0.55, 0.57)]
    for _ in range(rng.integers(0, 4)):
        angle = rng.uniform(0.0, 2.0 * np.pi)
        feet = np.array([np.cos(angle), np.sin(angle), 0.0]) * rng.uniform(450.0, 900.0)
        head = feet * rng.uniform(0.75, 1.0) + [0.0, 0.0, rng.uniform(1550.0, 1850.0)]
        gown = [(0.10, 0.35, 0.45), (0.15, 0.42, 0.30), (0.75, 0.78, 0.80)][rng.integers(3)]
        rods += [[*(head - [0.0, 0.0, 350.0]), *(feet * 1.1), 210.0], [*head, *head, 120.0]]
        colours += [gown, (0.70, 0.52, 0.44)]
        hand = np.array([*rng.uniform(-250.0, 250.0, 2), 1250.0])
        rods.append([*(head - [0.0, 0.0, 350.0]), *hand, 60.0])
        colours.append(gown)
    handle = room_from_camera.apply([[*rng.normal(size=2) * 12.0, 90.0], [*rng.normal(size=2) * 40.0, 230.0]])
    rods.append([*handle[0], *handle[1], 9.0])
    colours.append((0.15, 0.15, 0.17))
    return np.array(rods), np.array(colours)


def _false_patches(room: Room, layout: CrossLayout, rng: np.random.Generator) -> list[Patch]:
    """Coloured sheets and crosses of one colour, such as signs, between the crosses."""
    taken = [cross.room_from_cross.translation_mm for cross in layout.crosses]
    size = max(cross.size_mm for cross in layout.crosses)
    patches = []
    for _ in range(10):
        area = room.areas[rng.integers(len(room.areas))]
        centre = _place(area, rng)
        if min(np.linalg.norm(centre - other) for other in taken) > 1.45 * size:
            taken.append(centre)
            inks = np.array(list(INKS.values()))[rng.integers(4)] * rng.uniform(0.8, 1.1)
            cross = size * rng.uniform(0.6, 1.0) if rng.random() < 0.5 else 0.0
            paper = np.array(PAPER) if cross else inks
            half = tuple(rng.uniform(0.35, 0.55, 2) * size)
            patches.append(
                Patch(centre, area.right, area.down, (half[0], half[1]), cross, np.array([paper, *[inks] * 5]))
            )
    return patches


def _place(area: HangingArea, rng: np.random.Generator) -> FloatArray:
    across, along = rng.uniform(-0.5, 0.5, 2) * [area.width_mm, area.height_mm]
    place: FloatArray = area.centre_mm + across * area.right + along * area.down
    return place


def _glare(scene: Scene, rng: np.random.Generator) -> FloatArray:
    """On a quarter of the sheets a lamp is reflected."""
    spots = []
    for patch in scene.patches:
        if rng.random() < 0.25:
            across, along = rng.uniform(-1.0, 1.0, 2) * patch.half_mm
            place = patch.centre_mm + across * patch.right + along * patch.down
            spots.append([*place, rng.uniform(0.15, 0.4) * patch.half_mm[0] * 2.0, rng.uniform(0.2, 0.6)])
    return np.array(spots).reshape(-1, 5)

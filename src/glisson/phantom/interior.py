"""What lies inside the organ, built from its proportions: duct, tumours, vessel trees, Couinaud planes."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import trimesh

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TriangleSurface
from glisson.core.structures import Curve, VesselTree
from glisson.phantom.couinaud import CouinaudPlanes, plane_along
from glisson.phantom.implicit import Solid, cone, ellipsoid, grown, moved_inside, union
from glisson.phantom.liver_shape import LiverShape
from glisson.phantom.proportions import Proportions
from glisson.phantom.vessels import Growth, scattered_targets, smooth_path

DUCT_RADIUS_MM = 1.8
WIRE_RADIUS_MM = 0.5

# Control points of the nominal member, organ coordinates (mm).
_DUCT = [
    [-2.0, -9.0, -14.0],
    [12.0, -14.0, -11.0],
    [27.0, -16.0, -5.0],
    [42.0, -16.5, 2.0],
    [56.0, -15.5, 9.0],
    [68.0, -13.0, 17.0],
]
_CONFLUENCE = [-12, -24, 44]
_RIGHT_VEIN = [[-36, -36, 31], [-66, -38, 4], [-91, -33, -34]]
_MIDDLE_VEIN = [[-16, -34, 26], [-24, -36, 0], [-33, -30, -38]]
_LEFT_VEIN = [[-2, -29, 36], [8, -28, 18], [17, -24, -12]]
_LATERAL_VEINS = [[[24, -25, 32], [48, -18, 44]], [[24, -22, -8], [36, -16, -14]]]
_HILUM = [-9, -8, -9]
_BIFURCATION = [-12, -17, -7]
_RIGHT_PORTAL = [[-30, -22, -5.5]]
_RIGHT_BRANCHES = [
    [[-46, -36, 10], [-60, -46, 30]],
    [[-40, -33, -24], [-54, -33, -50]],
    [[-60, -22, 14], [-84, -20, 34]],
    [[-66, -18, -16], [-92, -16, -30]],
]
_LEFT_PORTAL = [[4, -22, -2], [16, -22, 2]]
_LEFT_BRANCHES = [[[21, -23, 18], [29, -20, 42]], [[28, -23, -4], [40, -22, -10]], [[12, -18, -14], [4, -14, -32]]]
_CAUDATE = ([-8, -6, 22], [20, 21, 25])


@dataclass(frozen=True, eq=False)
class EllipsoidTumour:
    """A tumour of the rest shape, with semi-axes along x, y, z (mm)."""

    name: str
    centre_mm: FloatArray
    radii_mm: FloatArray

    @property
    def solid(self) -> Solid:
        """The tumour as an implicit function."""
        return ellipsoid(self.centre_mm, self.radii_mm)

    @property
    def surface(self) -> TriangleSurface:
        """The tumour as a closed surface of 5120 triangles (volume 0.1 % below the ellipsoid's)."""
        sphere = trimesh.creation.icosphere(subdivisions=4)
        return TriangleSurface(sphere.vertices * self.radii_mm + self.centre_mm, sphere.faces)


@dataclass(frozen=True, eq=False)
class Interior:
    """Everything embedded, in the rest shape. `wire_length_mm` of wire are in the duct from its mouth."""

    tumours: tuple[EllipsoidTumour, ...]
    duct: Curve
    wire_length_mm: float
    portal: VesselTree
    hepatic: VesselTree
    planes: CouinaudPlanes


def build_interior(proportions: Proportions, shape: LiverShape, seed: int) -> Interior:
    """The interior of one member; `seed` also draws the twigs."""
    random = np.random.default_rng([seed, 1])
    duct = _duct(proportions, shape.liver)
    tumours = _tumours(proportions, shape.liver, duct)
    keep_out = union([grown(tumour.solid, 3.0) for tumour in tumours] + [_guard(duct, 4.0)])
    portal = _portal_tree(proportions, shape.liver, keep_out, random)
    hepatic = _hepatic_tree(proportions, shape.liver, keep_out, random)
    # The wire's tip lies a little beyond the place of the duct that is nearest to the first tumour.
    near = int(np.linalg.norm(duct.points_mm - tumours[0].centre_mm, axis=1).argmin())
    wire_length = float(duct.arc_lengths_mm[near] + 4.0)
    return Interior(tumours, duct, wire_length, portal, hepatic, _planes(proportions))


def _duct(proportions: Proportions, liver: Solid) -> Curve:
    controls = proportions.place(_DUCT)
    controls[0] = moved_inside(liver, controls[0], DUCT_RADIUS_MM + 1.0)
    return Curve(smooth_path(controls, 2.0))


def _guard(duct: Curve, by_mm: float) -> Solid:
    """The duct grown by a margin, without its first 15 mm, where the portal vein may be near."""
    points = duct.points_mm[duct.arc_lengths_mm > 15.0][::3]
    radius = DUCT_RADIUS_MM + by_mm
    return union([cone(a, b, radius, radius) for a, b in pairwise(points)])


def _tumours(proportions: Proportions, liver: Solid, duct: Curve) -> tuple[EllipsoidTumour, ...]:
    """One tumour beside the duct in the left lobe, and for some members a second one in the right lobe."""
    middle = round(proportions.station * (len(duct.points_mm) - 1))
    tangent = duct.points_mm[middle + 1] - duct.points_mm[middle - 1]
    # Across the duct, cranial: the lobe is widest there.
    across = np.cross(tangent, [0.0, 1.0, 0.0])
    across *= np.sign(across[2]) / np.linalg.norm(across)
    radii = proportions.tumour_radii_mm
    reach = DUCT_RADIUS_MM + proportions.gap_mm + 1.0 / float(np.linalg.norm(across / radii))
    first = EllipsoidTumour("tumour1", duct.points_mm[middle] + reach * across, radii)
    tumours = [_fitted(first, liver)]
    if proportions.second_tumour:
        second = EllipsoidTumour("tumour2", proportions.place([-84.0, -40.0, 22.0]), radii[::-1] * 0.9)
        tumours.append(_fitted(second, liver))
    return tuple(tumours)


def _fitted(tumour: EllipsoidTumour, liver: Solid) -> EllipsoidTumour:
    """The tumour, moved up or down where needed so that 2.5 mm of parenchyma cover it."""
    centre = moved_inside(liver, tumour.centre_mm, float(tumour.radii_mm.max()) + 2.5)
    return EllipsoidTumour(tumour.name, centre, tumour.radii_mm)


def _portal_tree(proportions: Proportions, liver: Solid, away: Solid, random: np.random.Generator) -> VesselTree:
    place = proportions.place
    growth = Growth(moved_inside(liver, place(_HILUM), 1.5))
    growth.branch([place(_BIFURCATION)])
    growth.branch(list(place(_RIGHT_PORTAL)))
    for branch in _RIGHT_BRANCHES:
        growth.branch(list(place(branch)))
    growth.branch(list(place(_LEFT_PORTAL)))
    for branch in _LEFT_BRANCHES:
        growth.branch(list(place(branch)))
    return _with_twigs(growth, liver, away, 90, random).finish("portal", 6.0)


def _hepatic_tree(proportions: Proportions, liver: Solid, away: Solid, random: np.random.Generator) -> VesselTree:
    place = proportions.place
    growth = Growth(moved_inside(liver, place(_CONFLUENCE), 2.0))
    for vein in (_RIGHT_VEIN, _MIDDLE_VEIN, _LEFT_VEIN, *_LATERAL_VEINS):
        growth.branch(list(place(vein)))
    return _with_twigs(growth, liver, away, 80, random).finish("hepatic", 6.5)


def _with_twigs(growth: Growth, liver: Solid, away: Solid, count: int, random: np.random.Generator) -> Growth:
    """Grow twigs, nearest targets first, that stay 3 mm inside the organ and out of `away`."""
    targets = scattered_targets(liver, 7.0, count, random, away)
    order = np.argsort([np.linalg.norm(np.array(growth.points) - t, axis=1).min() for t in targets])

    def allowed(path: FloatArray) -> bool:
        return bool(liver.distance(path).max() < -3.0 and away.distance(path[1:]).min() > 0.0)

    for target in targets[order]:
        growth.twig(target, random, allowed)
    return growth


def _planes(proportions: Proportions) -> CouinaudPlanes:
    place = proportions.place
    root = place(_CONFLUENCE)
    far_left = place([200.0, 0.0, 0.0])
    cranial = place([0.0, 0.0, 300.0])
    split = place(_BIFURCATION)
    centre, radii = _CAUDATE
    return CouinaudPlanes(
        right_scissura=plane_along(root, place(_RIGHT_VEIN[-1]), far_left, tilt=0.35),
        middle_scissura=plane_along(root, place(_MIDDLE_VEIN[-1]), far_left, tilt=0.1),
        left_scissura=plane_along(root, place(_LEFT_VEIN[-1]), far_left),
        right_portal=plane_along(split, place(_RIGHT_PORTAL[-1]), cranial),
        left_portal=plane_along(place(_LEFT_PORTAL[-1]), place([60.0, -20.0, 17.0]), cranial),
        caudate=ellipsoid(place(centre), np.array(radii) * [1.0, proportions.thick, proportions.tall]),
    )

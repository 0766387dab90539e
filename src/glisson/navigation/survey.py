"""One deformation surveyed: where tumours, wire and planes are in it. The same for a simulation and a truth."""

from dataclasses import dataclass

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation
from glisson.core.errors import BadInput
from glisson.core.mesh import TriangleSurface
from glisson.core.structures import Plane, Structures, Tumour
from glisson.geometry.mapping import PointMap
from glisson.geometry.wire import Wire
from glisson.navigation.plan import Plan
from glisson.navigation.resection import CarriedPlane, carry_plane, rule_plane
from glisson.navigation.volumes import organ_volume_mm3, removed_fraction
from glisson.navigation.wire import carried_wire

_OUTSIDE_MM = 5.0


@dataclass(frozen=True, eq=False)
class PlanInA:
    """What the plan means in the scanned shape A, whatever the deformation.

    `plane` is None where there is neither a wire with a tumour nor a plane in the plan; `by_rule` says
    which of both made it.
    """

    target: Tumour | None
    wire: Wire | None
    plane: Plane | None
    by_rule: bool
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Survey:
    """What a deformation does to the structures (B), and the removed fractions of the organ's volume."""

    point_map: PointMap
    nodes_mm: FloatArray
    tumours: tuple[Tumour, ...]
    wire: Wire | None
    slide_mm: float | None
    carried: CarriedPlane | None
    rule: Plane | None
    organ_before_mm3: float
    removed_before: float | None
    removed_by_carried: float | None
    removed_by_rule: float | None
    notes: tuple[str, ...]

    def tumour(self, name: str) -> Tumour:
        """The tumour in B that carries `name`."""
        return next(tumour for tumour in self.tumours if tumour.name == name)


def read_plan(structures: Structures, plan: Plan) -> PlanInA:
    """Find the target tumour, the wire and the resection plane in A.

    Raises:
        BadInput: no tumour has the target's name, or a tumour's surface is not closed.
    """
    target = _target(structures, plan)
    wire = None
    if structures.duct is not None and structures.wire_length_mm is not None:
        wire = Wire(structures.duct.points_mm, structures.wire_length_mm)
    notes = [] if wire else ["There is no wire in the model, so nothing is told of a wire."]
    plane = plan.plane
    if plane is not None:
        notes.append("The resection plane was given by three points, so there is no plane by the rule.")
        side, more = _towards_target(plane, target)
        return PlanInA(target, wire, side, False, tuple(notes + more))
    if wire is None or target is None:
        missing = "wire" if wire is None else "tumour"
        notes.append(
            f"Without a {missing} there is no resection plane by the rule; give three points of a plane "
            "in the case file to have one carried."
        )
        return PlanInA(target, wire, None, False, tuple(notes))
    rule = rule_plane(wire, target.surface, plan.distance_mm)
    return PlanInA(target, wire, rule.plane, True, (*notes, *(f"Before: {_lower(note)}" for note in rule.notes)))


def survey(deformation: Deformation, structures: Structures, plan: Plan, in_a: PlanInA) -> Survey:
    """Carry the structures through the last stage of a deformation and apply the plan there.

    Raises:
        BadInput: the deformation has no stage.
    """
    mesh, displacement = deformation.mesh, deformation.displacement
    point_map, nodes = PointMap(mesh, displacement), mesh.moved(displacement)
    tumours = tuple(_carried_tumour(tumour, point_map) for tumour in structures.tumours)
    notes: list[str] = []
    wire, slide = None, None
    if in_a.wire is not None and structures.duct is not None:
        wire, slide = carried_wire(structures.duct, in_a.wire.length_mm, point_map)
        notes += _outside_notes(in_a.wire, point_map)
    carried, rule = None, None
    if in_a.plane is not None:
        carried = carry_plane(in_a.plane, point_map)
        if carried is None:
            notes.append("The plane by the rule does not meet the liver, so it cannot be carried along.")
    if in_a.by_rule and wire is not None and in_a.target is not None:
        after = next(tumour for tumour in tumours if tumour.name == in_a.target.name)
        ruled = rule_plane(wire, after.surface, plan.distance_mm)
        rule = ruled.plane
        notes += [f"After: {_lower(note)}" for note in ruled.notes]
    return Survey(
        point_map,
        nodes,
        tumours,
        wire,
        slide,
        carried,
        rule,
        organ_volume_mm3(mesh, mesh.nodes),
        None if in_a.plane is None else removed_fraction(mesh, mesh.nodes, in_a.plane),
        None if carried is None else removed_fraction(mesh, nodes, carried.plane),
        None if rule is None else removed_fraction(mesh, nodes, rule),
        tuple(notes),
    )


def _target(structures: Structures, plan: Plan) -> Tumour | None:
    tumours = structures.tumours
    for tumour in tumours:
        if not tumour.surface.is_closed:
            raise BadInput(f"The surface of {tumour.name!r} is not closed, so it has no volume; repair its mask.")
    if plan.target is None:
        return max(tumours, key=lambda tumour: tumour.volume_mm3, default=None)
    for tumour in tumours:
        if tumour.name == plan.target:
            return tumour
    names = ", ".join(tumour.name for tumour in tumours) or "none"
    raise BadInput(f"The target {plan.target!r} is not a tumour of the model (it has: {names}); correct the target.")


def _towards_target(plane: Plane, target: Tumour | None) -> tuple[Plane, list[str]]:
    """The plane with its normal on the target's side, and what is to be said about it."""
    if target is None:
        return plane, ["There is no tumour, so the removed side is the one that the three points' order points to."]
    heights = plane.distance_mm(target.surface.vertices)
    cut = [f"The planned plane cuts through {target.name}."] if heights.min() < 0.0 < heights.max() else []
    if float(plane.distance_mm(target.centroid_mm[None])[0]) < 0.0:
        return Plane(plane.point_mm, -plane.normal), cut
    return plane, cut


def _carried_tumour(tumour: Tumour, point_map: PointMap) -> Tumour:
    surface = TriangleSurface(point_map.forward(tumour.surface.vertices), tumour.surface.triangles)
    return Tumour(tumour.name, surface)


def _outside_notes(wire: Wire, point_map: PointMap) -> list[str]:
    distance = point_map.locate(wire.points_mm).distance_mm
    if float(distance.max()) <= _OUTSIDE_MM:
        return []
    return [
        f"The wire lies up to {distance.max():.0f} mm outside the liver's mesh; there its motion is extrapolated "
        "from the nearest tissue."
    ]


def _lower(sentence: str) -> str:
    return sentence[0].lower() + sentence[1:]

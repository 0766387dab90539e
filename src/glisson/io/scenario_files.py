"""`scenario.toml`: what is done to the organ, for people to read and change (LPS mm, degrees, N, kPa)."""

from pathlib import Path
from typing import Any, cast

from glisson.core import (
    Board,
    ContactLaw,
    Cylinder,
    Lever,
    LeverDrive,
    MeshTool,
    Move,
    Scenario,
    Slot,
    Stage,
    ToolMotion,
    TriangleSurface,
)
from glisson.core.arrays import FloatArray
from glisson.io.records import Record, read_record, write_toml

SCHEMA = 1
"""Version of the layout of `scenario.toml` that is written; older ones are read."""

_DIRECTIONS = ("scan_gravity", "surgery_gravity")


def read_scenario(path: str | Path) -> Scenario:
    """Read a scenario; tools come out as boards first, then levers, cylinders and mesh tools.

    Raises:
        BadInput: absent, damaged, of a newer Glisson; an unknown key, a wrong type or an impossible value,
            named by its key path ("stages[1].friction").
    """
    with read_record(Path(path), "a scenario", SCHEMA) as record:
        boards = [_board(entry) for entry in record.records("boards", ())]
        levers = [_lever(entry) for entry in record.records("levers", ())]
        cylinders = [_cylinder(entry) for entry in record.records("cylinders", ())]
        meshes = [_mesh_tool(entry) for entry in record.records("mesh_tools", ())]
        return Scenario(
            tools=(*boards, *levers, *cylinders, *meshes),
            stages=tuple(_stage(entry) for entry in record.records("stages")),
            scan_gravity=_direction(record, "scan_gravity"),
            surgery_gravity=_direction(record, "surgery_gravity"),
            scan_supports=record.texts("scan_supports", ()),
            rest_shape=cast(Any, record.text("rest_shape", "from-gravity")),  # the core type checks the choice
        )


def write_scenario(path: str | Path, scenario: Scenario) -> None:
    """Write a scenario; atomic. A gravity that is None is left out.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    table: dict[str, Any] = {"schema": SCHEMA, "rest_shape": scenario.rest_shape}
    for key in _DIRECTIONS:
        direction = getattr(scenario, key)
        if direction is not None:
            table[key] = direction.tolist()
    table["scan_supports"] = list(scenario.scan_supports)
    table["boards"] = [_board_table(tool) for tool in scenario.tools if isinstance(tool, Board)]
    table["levers"] = [_lever_table(tool) for tool in scenario.tools if isinstance(tool, Lever)]
    table["cylinders"] = [_cylinder_table(tool) for tool in scenario.tools if isinstance(tool, Cylinder)]
    table["mesh_tools"] = [_mesh_tool_table(tool) for tool in scenario.tools if isinstance(tool, MeshTool)]
    table["stages"] = [_stage_table(stage) for stage in scenario.stages]
    write_toml(path, table)


def _direction(record: Record, key: str) -> FloatArray | None:
    return record.floats(key, 3) if record.has(key) else None


def _board(record: Record) -> Board:
    with record.building():
        return Board(
            record.text("name"),
            record.floats("point_mm", 3),
            record.floats("normal", 3),
            record.flag("conforming", Board.conforming),
            _slot(record.record("slot")) if record.has("slot") else None,
        )


def _slot(record: Record) -> Slot:
    with record.building():
        return Slot(
            record.floats("centre_mm", 3),
            record.floats("along", 3),
            record.number("length_mm"),
            record.number("width_mm"),
            record.number("edge_radius_mm", Slot.edge_radius_mm),
        )


def _lever(record: Record) -> Lever:
    sizes = ("length_mm", "width_mm", "thickness_mm", "edge_radius_mm")
    with record.building():
        return Lever(
            name=record.text("name"),
            hinge_mm=record.floats("hinge_mm", 3),
            axis=record.floats("axis", 3),
            arm=record.floats("arm", 3),
            **{size: record.number(size) for size in sizes if record.has(size)},
        )


def _cylinder(record: Record) -> Cylinder:
    with record.building():
        return Cylinder(
            record.text("name"), record.floats("start_mm", 3), record.floats("end_mm", 3), record.number("radius_mm")
        )


def _mesh_tool(record: Record) -> MeshTool:
    with record.building():
        surface = TriangleSurface(record.floats("vertices_mm", -1, 3), record.wholes("triangles", -1, 3))
        return MeshTool(record.text("name"), surface, record.number("skin_mm", MeshTool.skin_mm))


def _stage(record: Record) -> Stage:
    with record.building():
        contact = ContactLaw(
            friction=record.number("friction", ContactLaw.friction),
            cohesion_kpa=record.number("cohesion_kpa", ContactLaw.cohesion_kpa),
        )
        return Stage(
            name=record.text("name"),
            contact=contact,
            drives=tuple(_drive(entry) for entry in record.records("drives", ())),
            gravity=record.flag("gravity", Stage.gravity),
            fixed=record.texts("fixed", Stage.fixed),
            moves=tuple(_move(entry) for entry in record.records("moves", ())),
            gas_pressure_kpa=record.number("gas_pressure_kpa", Stage.gas_pressure_kpa),
            motions=tuple(_motion(entry) for entry in record.records("motions", ())),
        )


def _drive(record: Record) -> LeverDrive:
    with record.building():
        return LeverDrive(record.text("lever"), record.number_or_none("angle_deg"), record.number_or_none("force_n"))


def _motion(record: Record) -> ToolMotion:
    vectors = ("displacement_mm", "turn_deg", "about_mm")
    with record.building():
        given = {key: record.floats(key, 3).tolist() for key in vectors if record.has(key)}
        return ToolMotion(record.text("tool"), **{key: tuple(value) for key, value in given.items()})


def _move(record: Record) -> Move:
    with record.building():
        x, y, z = record.floats("displacement_mm", 3)
        return Move(record.text("node_set"), (float(x), float(y), float(z)))


def _board_table(board: Board) -> dict[str, Any]:
    return {
        "name": board.name,
        "point_mm": board.point_mm.tolist(),
        "normal": board.normal.tolist(),
        "conforming": board.conforming,
        **({} if board.slot is None else {"slot": _slot_table(board.slot)}),
    }


def _slot_table(slot: Slot) -> dict[str, Any]:
    return {
        "centre_mm": slot.centre_mm.tolist(),
        "along": slot.along.tolist(),
        "length_mm": float(slot.length_mm),
        "width_mm": float(slot.width_mm),
        "edge_radius_mm": float(slot.edge_radius_mm),
    }


def _lever_table(lever: Lever) -> dict[str, Any]:
    return {
        "name": lever.name,
        "hinge_mm": lever.hinge_mm.tolist(),
        "axis": lever.axis.tolist(),
        "arm": lever.arm.tolist(),
        "length_mm": float(lever.length_mm),
        "width_mm": float(lever.width_mm),
        "thickness_mm": float(lever.thickness_mm),
        "edge_radius_mm": float(lever.edge_radius_mm),
    }


def _cylinder_table(cylinder: Cylinder) -> dict[str, Any]:
    return {
        "name": cylinder.name,
        "start_mm": cylinder.start_mm.tolist(),
        "end_mm": cylinder.end_mm.tolist(),
        "radius_mm": float(cylinder.radius_mm),
    }


def _mesh_tool_table(tool: MeshTool) -> dict[str, Any]:
    return {
        "name": tool.name,
        "vertices_mm": tool.surface.vertices.tolist(),
        "triangles": tool.surface.triangles.tolist(),
        "skin_mm": float(tool.skin_mm),
    }


def _motion_table(motion: ToolMotion) -> dict[str, Any]:
    about = {} if motion.about_mm is None else {"about_mm": list(motion.about_mm)}
    vectors = {"displacement_mm": list(motion.displacement_mm), "turn_deg": list(motion.turn_deg)}
    return {"tool": motion.tool} | vectors | about


def _stage_table(stage: Stage) -> dict[str, Any]:
    drives = []
    for drive in stage.drives:
        target = {"angle_deg": drive.angle_deg, "force_n": drive.force_n}
        drives.append({"lever": drive.lever} | {key: float(v) for key, v in target.items() if v is not None})
    return {
        "name": stage.name,
        "friction": float(stage.contact.friction),
        "cohesion_kpa": float(stage.contact.cohesion_kpa),
        "gravity": stage.gravity,
        "fixed": list(stage.fixed),
        "drives": drives,
        "moves": [{"node_set": move.node_set, "displacement_mm": list(move.displacement_mm)} for move in stage.moves],
        "gas_pressure_kpa": float(stage.gas_pressure_kpa),
        "motions": [_motion_table(motion) for motion in stage.motions],
    }

"""What each tool does to the organ at the end of a stage, in the units that people read."""

from math import degrees

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.deformation import ContactReport
from glisson.core.units import newton_metres_from_internal, newtons_from_millinewtons
from glisson.mechanics.body import Body
from glisson.mechanics.lever_tool import LeverTool


def report_contacts(body: Body, positions: FloatArray) -> tuple[ContactReport, ...]:
    """One report for each tool at node positions (n, 3)."""
    return tuple(_report(body, number, positions) for number in range(len(body.contacts)))


def hinge_moment(body: Body, number: int, positions: FloatArray) -> float:
    """Moment in mN·mm about a lever's axis with which the organ resists lifting."""
    contact = body.contacts[number]
    assert isinstance(contact.tool, LeverTool)  # boards have no hinge
    points = body.surface.positions(positions)
    forces = contact.forces(contact.touch(points), points)
    moments = np.cross(points - contact.tool.lever.hinge_mm, forces).sum(axis=0)
    return float(moments @ contact.tool.lever.axis)


def _report(body: Body, number: int, positions: FloatArray) -> ContactReport:
    contact = body.contacts[number]
    points = body.surface.positions(positions)
    touch = contact.touch(points)
    force = contact.forces(touch, points).sum(axis=0)
    sticking, slip = contact.sticking(touch, points)
    is_lever = isinstance(contact.tool, LeverTool)
    return ContactReport(
        tool=contact.tool.name,
        force_n=tuple(newtons_from_millinewtons(float(f)) for f in force),  # type: ignore[arg-type]  # three of them
        area_mm2=float(body.surface.areas[touch.points].sum()),
        largest_pressure_kpa=float(touch.pressures.max(initial=0.0)),
        least_gap_mm=None if contact.tool.yields else float(contact.gaps(points).min()),
        sticking=sticking,
        largest_slip_mm=slip,
        angle_deg=degrees(contact.angle) if is_lever else None,
        hinge_moment_nm=newton_metres_from_internal(hinge_moment(body, number, positions)) if is_lever else None,
    )

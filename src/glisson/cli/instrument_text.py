"""What `glisson instruments` says, for machines and for people."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from glisson.cli.console import Answer
from glisson.core.arrays import FloatArray
from glisson.core.instruments import Instrument, InstrumentLibrary
from glisson.core.localisation import Localisation
from glisson.framework.instrument_timeline import PICTURE, Timeline
from glisson.framework.instruments import Recognised
from glisson.intraoperative.instruments.codes import Alike
from glisson.intraoperative.instruments.timeline import total_seconds


def library_answer(
    library: InstrumentLibrary, alike: Sequence[Alike] | None = None, added: Instrument | None = None
) -> Answer:
    """The instruments of a library; with `alike` what may be mistaken, which makes the exit code 1."""
    rows = [_row(instrument) for instrument in library.instruments]
    lines = [
        f"{row['name']:20s} {row['length_mm']:6.1f} mm, wheel {row['wheel_mm']:g} mm, {', '.join(row['colours'])}"
        for row in rows
    ]
    values: dict[str, Any] = {"instruments": rows}
    if added is not None:
        values["instrument"] = _row(added)
        lines = [f"added     {added.name}: {', '.join(added.colours)}; print it with glisson markers wheel"]
    if alike is not None:
        values["alike"] = [entry.sentence for entry in alike]
        good = f"The codes of {len(rows)} instruments" if len(rows) != 1 else "The turns of the only code"
        lines = values["alike"] or [f"{good} can be told apart, mirrored or not."]
    return Answer(values, "\n".join(lines), 1 if alike else 0)


def recognised_answer(done: Recognised) -> Answer:
    """Name, pose and tip, the tip in the room where the trocar's place is known."""
    seen = done.seen
    values: dict[str, Any] = {
        "status": "converged",
        "instrument": seen.instrument.name,
        "code": list(seen.instrument.colours),
        "distance_mm": seen.distance_mm,
        "angle_deg": float(np.degrees(seen.angle_rad)),
        "off_pivot_mm": seen.off_pivot_mm,
        "tip_mm": seen.tip_mm.tolist(),
        "tip_covariance_mm2": seen.tip_covariance_mm2.tolist(),
        "room": None if done.place is None else _in_room(done, done.place),
        "picture": str(done.picture),
    }
    lines = [
        f"instrument  {seen.instrument.name}",
        f"wheel       {seen.distance_mm:.1f} mm away, its axis {values['angle_deg']:.2f}° from the channel's",
        f"tip         {_point(seen.tip_mm, seen.tip_covariance_mm2)} from the camera",
    ]
    if done.place is not None:
        room = values["room"]
        told = "not known: " + done.place.message
        if room["tip_mm"] is not None:
            told = f"{_point(np.array(room['tip_mm']), np.array(room['tip_covariance_mm2']))} in the room"
        lines.append(f"tip         {told}")
    return Answer(values, "\n".join([*lines, f"picture     {done.picture}"]))


def timeline_answer(told: Timeline, folder: str) -> Answer:
    """The uses, and how many frames showed an instrument."""
    totals = total_seconds(told.uses)
    values = {
        "uses": [
            {"instrument": use.instrument, "from_s": use.from_s, "to_s": use.to_s, "frames": use.frames}
            for use in told.uses
        ],
        "total_s": totals,
        "frames": told.frames,
        "recognised": told.recognised,
        "not_recognised": told.reasons,
        "notes": list(told.notes),
        "picture": f"{folder}/{PICTURE}",
    }
    lines = [f"{use.from_s:8.1f} to {use.to_s:8.1f} s  {use.instrument} ({use.frames} frames)" for use in told.uses]
    lines += [f"in all      {name}: {seconds:.1f} s" for name, seconds in totals.items()]
    reasons = ", ".join(f"{count} {status}" for status, count in told.reasons.items())
    lines.append(
        f"frames      {told.recognised} of {told.frames} with an instrument" + (f"; {reasons}" if reasons else "")
    )
    lines += [f"note        {note}" for note in told.notes]
    return Answer(values, "\n".join([*lines, f"written     {folder}"]))


def _row(instrument: Instrument) -> dict[str, Any]:
    return {
        "name": instrument.name,
        "length_mm": instrument.length_mm,
        "wheel_mm": instrument.wheel_mm,
        "colours": list(instrument.colours),
    }


def _in_room(done: Recognised, place: Localisation) -> dict[str, Any]:
    values: dict[str, Any] = {
        "status": place.status,
        "message": place.message,
        "tip_mm": None,
        "tip_covariance_mm2": None,
    }
    if place.status.is_good and place.room_from_trocar is not None:
        tip, own = done.seen.tip_mm, done.seen.tip_covariance_mm2
        values["tip_mm"] = place.room_from_trocar.apply(tip).tolist()
        values["tip_covariance_mm2"] = place.room_from_trocar.point_covariance(tip, own).tolist()
    return values


def _point(point: FloatArray, covariance: FloatArray) -> str:
    x, y, z = point
    return f"({x:.2f}, {y:.2f}, {z:.2f}) mm ± {float(np.sqrt(np.linalg.eigvalsh(covariance)[-1])):.2f} mm"

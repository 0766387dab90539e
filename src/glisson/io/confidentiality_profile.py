"""The Basic Application Level Confidentiality Profile of DICOM (PS3.15, Annex E, Table E.1-1 as of 2026c).

Where the table leaves the action open, an attribute gets what keeps any kind of object valid: a dummy where one may be
needed, else nothing as its value. Private attributes, overlays, curves and what no dictionary knows are removed.
"""

import csv
from functools import cache
from hashlib import sha256
from importlib.resources import files
from typing import Any
from uuid import UUID

from pydicom.datadict import dictionary_has_tag, dictionary_VR
from pydicom.dataelem import DataElement
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence
from pydicom.uid import UID

_METHOD = "PS3.15 Basic Application Level Confidentiality Profile"
_CODE = ("113100", "DCM", "Basic Application Confidentiality Profile")

_GRAPHICS = (0x5000, 0x6000)
"""Groups of curves and overlays, with repeats up to 00FF above."""

_DUMMY_NUMBERS = ("FD", "FL", "SL", "SS", "SV", "UL", "US", "UV")
_DUMMY_BYTES = ("OB", "OD", "OF", "OL", "OV", "OW", "UN")
_DUMMIES = {
    "AS": "000Y", "DA": "19000101", "DS": "0", "DT": "19000101000000", "IS": "0", "TM": "000000", "UR": "urn:removed",
}  # fmt: skip
_DUMMY_TEXT = "REMOVED"

_UUID_ROOT = "2.25."
_OWN_BYTES = 11
"""So many bytes of a new UID come from the old one, and the other five from these: so it is known when met again."""


@cache
def profile_actions() -> dict[int, str]:
    """The table's action ("X", "Z", "D", "U", or several that it leaves open, as "X/Z") by tag."""
    table = files("glisson.io").joinpath("data", "confidentiality_profile.csv").read_text(encoding="utf-8")
    return {int(row["tag"], 16): row["action"] for row in csv.DictReader(table.splitlines())}


def apply_profile(dataset: Dataset) -> None:
    """Take out of a data set, in place, what the profile protects, and say in it that this was done.

    What is not protected stays byte for byte as it was read, pixels and geometry among it. UIDs are replaced in the
    same way wherever they stand (`replaced_uid`). Done twice, it changes nothing more.
    """
    _protect(dataset)
    dataset.PatientIdentityRemoved = "YES"
    dataset.DeidentificationMethod = _METHOD
    code = Dataset()
    code.CodeValue, code.CodingSchemeDesignator, code.CodeMeaning = _CODE
    dataset.DeidentificationMethodCodeSequence = Sequence([code])
    dataset.LongitudinalTemporalInformationModified = "REMOVED"


def replaced_uid(uid: str) -> str:
    """The UID (of a UUID, version 8 of RFC 9562) that stands for another one, always the same; its own stay."""
    if not uid or _is_own(uid):
        return uid
    own = bytearray(sha256(uid.encode()).digest()[:_OWN_BYTES])
    own[6], own[8] = 0x80 | own[6] & 0x0F, 0x80 | own[8] & 0x3F
    return f"{_UUID_ROOT}{UUID(bytes=bytes(own) + _check(bytes(own))).int}"


def _is_own(uid: str) -> bool:
    number = uid.removeprefix(_UUID_ROOT)
    if number == uid or not number.isdigit() or int(number) >= 1 << 128:
        return False
    made = UUID(int=int(number))
    return made.version == 8 and made.bytes[_OWN_BYTES:] == _check(made.bytes[:_OWN_BYTES])


def _check(own: bytes) -> bytes:
    return sha256(b"glisson" + own).digest()[: 16 - _OWN_BYTES]


def _protect(dataset: Dataset) -> None:
    for tag in list(dataset.keys()):
        if tag.is_private or (tag.group & 0xFF00) in _GRAPHICS or not dictionary_has_tag(tag):
            del dataset[tag]
            continue
        action, vr = profile_actions().get(int(tag), ""), _vr(dataset, tag)
        if action == "X":
            del dataset[tag]
        elif "D" in action:
            dataset[tag] = DataElement(tag, vr, _dummy(vr, dataset, tag))
        elif action.endswith("U") and vr == "UI":
            dataset[tag] = DataElement(tag, vr, _replaced(dataset[tag].value))
        elif action.endswith("Z"):
            dataset[tag] = DataElement(tag, vr, Sequence() if vr == "SQ" else None)
        elif vr == "SQ":
            for item in dataset[tag].value:
                _protect(item)


def _vr(dataset: Dataset, tag: Any) -> str:
    """Value representation as stored, or by the dictionary where none is: in implicit files, and for "unknown"."""
    stored = dataset.get_item(tag).VR
    return str(stored) if stored not in (None, "UN") else dictionary_VR(tag).split(" or ")[0]


def _dummy(vr: str, dataset: Dataset, tag: Any) -> Any:
    if vr == "UI":
        return _replaced(dataset[tag].value)
    if vr == "SQ":
        return Sequence([Dataset()])
    if vr in _DUMMY_NUMBERS:
        return 0
    return b"\0\0" if vr in _DUMMY_BYTES else _DUMMIES.get(vr, _DUMMY_TEXT)


def _replaced(value: Any) -> Any:
    if value is None or isinstance(value, str):
        return UID(replaced_uid(value or ""))
    return [UID(replaced_uid(one)) for one in value]

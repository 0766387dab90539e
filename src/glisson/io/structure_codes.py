"""Codes of structures, as segmentations name them (DICOM PS3.16, context groups 7150 to 7166; SNOMED CT)."""

import re
from typing import NamedTuple


class StructureCode(NamedTuple):
    """A code, its coding scheme and its meaning, in the order of DICOM's own triplets."""

    value: str
    scheme: str
    meaning: str


_ANATOMY = StructureCode("91723000", "SCT", "Anatomical Structure")
_ALTERED = StructureCode("49755003", "SCT", "Morphologically Altered Structure")
_OBJECT = StructureCode("260787004", "SCT", "Physical object")
_NEOPLASM = StructureCode("108369006", "SCT", "Neoplasm")

CODES = {
    "liver": StructureCode("10200004", "SCT", "Liver"),
    "portal": StructureCode("32764006", "SCT", "Portal vein"),
    "hepatic": StructureCode("8993003", "SCT", "Hepatic vein"),
    "artery": StructureCode("76015000", "SCT", "Hepatic artery"),
    "duct": StructureCode("28273000", "SCT", "Bile duct"),
    "gallbladder": StructureCode("28231008", "SCT", "Gallbladder"),
    "ivc": StructureCode("64131007", "SCT", "Inferior vena cava"),
    "wire": StructureCode("272224001", "SCT", "Guide Wire"),
    "bone": StructureCode("272673000", "SCT", "Bone"),
    "skin": StructureCode("39937001", "SCT", "Skin"),
}
"""Canonical names of structures that have a code of their own; a neoplasm's says too little of which one it is."""

_OWN_SCHEME = "99GLISSON"
"""Private coding scheme of structures that have no code here."""


def category_and_type(name: str) -> tuple[StructureCode, StructureCode]:
    """Codes for the category of a structure and for what it is, from its canonical name."""
    if re.fullmatch(r"tumour\d+", name):
        return _ALTERED, _NEOPLASM
    own = StructureCode(re.sub(r"\W+", "-", name)[:16], _OWN_SCHEME, name[:64])
    return _OBJECT if name in ("wire", "stent") else _ANATOMY, CODES.get(name, own)

"""SNOMED CT codes of structures, as DICOM segmentations name them (PS3.16, context groups 7150 to 7166)."""

import re

from pydicom.sr.codedict import codes
from pydicom.sr.coding import Code

_ANATOMY, _ALTERED = codes.SCT.AnatomicalStructure, Code("49755003", "SCT", "Morphologically Altered Structure")
_OBJECT = codes.SCT.PhysicalObject

_STRUCTURES = {
    "liver": codes.SCT.Liver,
    "portal": codes.SCT.PortalVein,
    "hepatic": codes.SCT.HepaticVein,
    "artery": codes.SCT.HepaticArtery,
    "duct": codes.SCT.BileDuct,
    "gallbladder": codes.SCT.Gallbladder,
    "ivc": codes.SCT.InferiorVenaCava,
    "bone": codes.SCT.Bone,
    "skin": codes.SCT.Skin,
    "segment 1": codes.SCT.CouinaudHepaticSegmentI,
    "segment 2": codes.SCT.CouinaudHepaticSegmentII,
    "segment 3": codes.SCT.CouinaudHepaticSegmentIII,
    "segment 4": codes.SCT.CouinaudHepaticSegmentIV,
    "segment 5": codes.SCT.CouinaudHepaticSegmentV,
    "segment 6": codes.SCT.CouinaudHepaticSegmentVI,
    "segment 7": codes.SCT.CouinaudHepaticSegmentVII,
    "segment 8": codes.SCT.CouinaudHepaticSegmentVIII,
}
_OWN_SCHEME = "99GLISSON"
"""Private coding scheme of structures that have no code here."""


def category_and_type(name: str) -> tuple[Code, Code]:
    """Codes for the category of a structure and for what it is, from its canonical name."""
    if name in _STRUCTURES:
        return _ANATOMY, _STRUCTURES[name]
    if re.fullmatch(r"tumour\d+", name):
        return _ALTERED, codes.SCT.Neoplasm
    if name == "wire":
        return _OBJECT, codes.SCT.GuideWire
    return _ANATOMY, Code(re.sub(r"\W+", "-", name)[:16], _OWN_SCHEME, name[:64])


def name_of_code(value: str, scheme: str) -> str | None:
    """Canonical name of a coded structure; None where its code is none of ours or says too little (a neoplasm)."""
    known = {code.value: name for name, code in (_STRUCTURES | {"wire": codes.SCT.GuideWire}).items()}
    return known.get(value) if scheme in ("SCT", "SRT") else None

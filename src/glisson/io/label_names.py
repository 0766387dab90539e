"""One name for one structure: the names of other tools are mapped to those that Glisson uses.

Canonical names: "liver", "tumour1", "tumour2" …, "portal", "hepatic", "artery", "duct", "wire",
"stent", "gallbladder", "ivc", and "vessels" where the systems are not told apart. Whatever is unknown keeps its own
name.
"""

import re
from collections.abc import Iterable, Mapping

_CANONICAL = {
    "portalvein": "portal",
    "portalveins": "portal",
    "portalveinandsplenicvein": "portal",
    "venoussystem": "hepatic",
    "hepaticvein": "hepatic",
    "hepaticveins": "hepatic",
    "hepaticartery": "artery",
    "arteries": "artery",
    "vessel": "vessels",
    "livervessel": "vessels",
    "livervessels": "vessels",
    "inferiorvenacava": "ivc",
    "venacava": "ivc",
    "bileduct": "duct",
    "bileducts": "duct",
    "biliarysystem": "duct",
    "biliarytract": "duct",
    "guidewire": "wire",
}
_PLAIN = ("liver", "gallbladder", "portal", "hepatic", "artery", "duct", "wire", "stent", "ivc", "vessels")
_TUMOUR = re.compile(r"^(?:liver|hepatic)?(?:tumou?r|lesion|metastas[ie]s)s?0*(\d*)$")


def canonical_name(name: str) -> str:
    """Glisson's name for a structure; "livertumor02" becomes "tumour2", an unknown name stays as it is."""
    plain = re.sub(r"[^a-z0-9]", "", name.lower())
    tumour = _TUMOUR.match(plain)
    if tumour:
        return f"tumour{tumour.group(1) or 1}"
    if plain in _PLAIN:
        return plain
    return _CANONICAL.get(plain, name)


def is_canonical(name: str) -> bool:
    """Whether a name is one of Glisson's own."""
    return name in _PLAIN or re.fullmatch(r"tumour\d+", name) is not None


def canonical_names(names: Iterable[str]) -> list[str]:
    """Canonical names in the same order, all different: a second claimant keeps its own name, a tumour gets
    the next free number.
    """
    taken: list[str] = []
    for name in names:
        found = canonical_name(name)
        if found in taken and found.startswith("tumour"):
            found = next(free for n in range(1, len(taken) + 2) if (free := f"tumour{n}") not in taken)
        elif found in taken:
            found = name if name not in taken else f"{name} ({taken.count(name) + 1})"
        taken.append(found)
    return taken


def canonical_table(names: Mapping[int, str]) -> dict[int, str]:
    """The same numbers with canonical names."""
    return dict(zip(names, canonical_names(names.values()), strict=True))

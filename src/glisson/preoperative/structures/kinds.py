"""What can be marked by clicks, and how large and how bright it may be."""

import re
from dataclasses import dataclass

from glisson.core.errors import BadInput


@dataclass(frozen=True)
class Kind:
    """A kind of structure.

    `largest_ml` is more than any has, so that a larger one leaked; one below `small_ml` is doubtful. `usual_hu` is what
    a CT shows of most of them; None: it tells nothing. Metal is thin and bright, all else is soft tissue or fluid.
    """

    noun: str
    largest_ml: float
    small_ml: float
    usual_hu: tuple[float, float] | None = None
    is_metal: bool = False


TUMOUR = Kind("tumour", 1500.0, 0.1)
GALLBLADDER = Kind("gallbladder", 300.0, 3.0, usual_hu=(0.0, 25.0))
WIRE = Kind("wire", 5.0, 0.02, is_metal=True)
STENT = Kind("stent", 20.0, 0.05, is_metal=True)

_BY_NAME = {kind.noun: kind for kind in (GALLBLADDER, WIRE, STENT)}


def kind_of(name: str) -> Kind:
    """The kind of a label's name.

    Raises:
        BadInput: the name is none that can be marked.
    """
    if re.fullmatch(r"tumour[1-9]\d*", name):
        return TUMOUR
    if name not in _BY_NAME:
        raise BadInput(f"A structure is tumour1, tumour2, …, {', '.join(_BY_NAME)}, not {name!r}.")
    return _BY_NAME[name]

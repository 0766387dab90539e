"""Where the public data of other groups lies that some checks compare with; it is no part of Glisson."""

import os
from pathlib import Path

from glisson.verification.check import Unavailable

_VARIABLE = "GLISSON_SHARED_DATA"
_USUAL = Path("..") / "shared" / "data"  # seen from a checkout


def shared_folder(*parts: str) -> Path:
    """A folder of the shared data.

    Raises:
        Unavailable: it is not there.
    """
    folder = Path(os.environ.get(_VARIABLE, _USUAL)).joinpath(*parts)
    if not folder.is_dir():
        raise Unavailable(f"real data not found at {folder} (set {_VARIABLE})")
    return folder

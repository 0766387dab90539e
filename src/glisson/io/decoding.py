"""The guard around every reader: bad files become one sentence, and nothing huge is unpacked."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from glisson.core import BadInput

MAX_VOXELS = 2**29
"""Largest image that is read: 512 × 512 × 2048 voxels, twice the longest whole-body CT we know of."""

MAX_IMAGE_BYTES = 2**31
"""Largest decoded image, 2 GiB: Glisson is made for laptops with 8 GB, and a copy must fit beside it."""

MAX_MESH_BYTES = 2**28
"""Largest mesh or text file that is read, 256 MiB: ten times a liver of two million tetrahedra."""

DEFLATE_RATIO = 1032
"""Deflate (gzip, zlib) never shrinks data by more than this factor (zlib's own statement)."""


@contextmanager
def decoding(path: str | Path, kind: str) -> Iterator[None]:
    """Turn whatever a reader throws into a sentence that starts with the path.

    Args:
        path: what is being read.
        kind: what it should be, with an article ("a NIfTI image").

    Raises:
        BadInput: the file is absent, unreadable or not what it should be.
    """
    try:
        yield
    except BadInput as error:
        # A file in a folder has put its own path there already.
        if str(error).startswith(str(path)):
            raise
        raise BadInput(f"{path}: {error}") from error
    except FileNotFoundError as error:
        raise BadInput(f"{error.filename or path} does not exist.") from error
    except PermissionError as error:
        raise BadInput(f"{error.filename or path} may not be read (permission denied).") from error
    except MemoryError as error:
        raise BadInput(f"{path} asks for more memory than there is; it is damaged or too large.") from error
    # Parsers of foreign formats throw anything on damaged files; all of it means the same to the user.
    except Exception as error:
        reason = (" ".join(str(error).split()) or type(error).__name__).rstrip(".")[:200]
        raise BadInput(f"{path} cannot be read as {kind}: it is damaged or of another kind ({reason}).") from error


def check_image_size(shape: Sequence[int], bytes_per_voxel: int) -> None:
    """Refuse an image by its header, before anything is decoded.

    Raises:
        BadInput: it has no voxels, or more than `MAX_VOXELS` or `MAX_IMAGE_BYTES`.
    """
    size = " × ".join(str(int(n)) for n in shape)
    if any(int(n) < 1 for n in shape):
        raise BadInput(f"its header gives the impossible size {size}.")
    voxels = math.prod(int(n) for n in shape)
    if voxels > MAX_VOXELS or voxels * bytes_per_voxel > MAX_IMAGE_BYTES:
        raise BadInput(
            f"its header asks for {size} voxels ({voxels * bytes_per_voxel / 1e9:.1f} GB); "
            f"Glisson reads up to {MAX_VOXELS / 1e6:.0f} million voxels and {MAX_IMAGE_BYTES / 1e9:.1f} GB, "
            "so crop or resample it first."
        )


def check_file_size(path: Path) -> None:
    """Refuse a mesh or text file above `MAX_MESH_BYTES`.

    Raises:
        BadInput: it is too large.
    """
    size = path.stat().st_size
    if size > MAX_MESH_BYTES:
        raise BadInput(
            f"it has {size / 1e6:.0f} MB; Glisson reads meshes and text up to {MAX_MESH_BYTES / 1e6:.0f} MB."
        )

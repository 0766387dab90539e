"""The stored values of a DICOM file's frames, whatever its transfer syntax packs them into.

pydicom's plug-ins decode: RLE (pydicom itself), JPEG 2000 (OpenJPEG), JPEG-LS (CharLS), JPEG of 8 bits (Pillow).
JPEG Lossless and JPEG Extended of 12 bits are decoded in this package, as no plug-in under a permissive licence does.
What a JPEG frame says of itself is checked before a decoder sees it.
"""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pydicom
from numpy.typing import NDArray
from pydicom.encaps import generate_frames
from pydicom.pixels.decoders.base import get_decoder
from pydicom.pixels.utils import iter_pixels
from pydicom.uid import (
    JPEGBaseline8Bit,
    JPEGExtended12Bit,
    JPEGLossless,
    JPEGLosslessSV1,
    JPEGLSLossless,
    JPEGLSNearLossless,
)

from glisson.core import BadInput
from glisson.io.dicom_headers import Slice, transfer_syntax
from glisson.io.jpeg_extended import decoded_extended
from glisson.io.jpeg_headers import BASELINE, EXTENDED, JPEG_LS, LOSSLESS, JpegFrame, read_jpeg_frame
from glisson.io.jpeg_lossless import decoded_lossless

_JPEG_PROCESSES = {
    JPEGBaseline8Bit: (BASELINE,),
    JPEGExtended12Bit: (BASELINE, EXTENDED),
    JPEGLossless: (LOSSLESS,),
    JPEGLosslessSV1: (LOSSLESS,),
    JPEGLSLossless: (JPEG_LS,),
    JPEGLSNearLossless: (JPEG_LS,),
}
_CODESTREAM = b"\xff\x4f\xff\x51"  # JPEG 2000: start of codestream, then the size marker
_ADVICE = "save it uncompressed (Explicit VR Little Endian) with another program first"


def stored_frames(described: Slice, frames: int) -> Iterator[NDArray[Any]]:
    """Stored values (rows, columns) of each frame of a file.

    Args:
        described: one of its slices.
        frames: how many it has.

    Raises:
        BadInput: no pixels, a transfer syntax that is not read, or frames that are damaged or contradict the header.
    """
    dataset = pydicom.dcmread(described.path, force=True)
    if "PixelData" not in dataset:
        raise BadInput("it lacks PixelData (7FE0,0010).")
    syntax = pydicom.uid.UID(transfer_syntax(dataset))
    dataset.file_meta.TransferSyntaxUID = syntax
    if syntax in (JPEGLossless, JPEGLosslessSV1):
        yield from _decoded_here(dataset, described, frames, decoded_lossless)
    elif syntax == JPEGExtended12Bit and described.bits_stored > 8:
        yield from _decoded_here(dataset, described, frames, decoded_extended)
    else:
        yield from _decoded_by_plugin(dataset, described, frames)


def _decoded_here(
    dataset: Any, described: Slice, frames: int, decoded: Callable[[JpegFrame], NDArray[np.uint16]]
) -> Iterator[NDArray[Any]]:
    unused = max(16 - described.bits_stored, 0)
    kind = np.int16 if described.is_signed else np.uint16
    for content in generate_frames(dataset.PixelData, number_of_frames=frames):
        samples = decoded(_checked_jpeg(content, dataset))
        yield (samples << unused).view(kind) >> unused


def _decoded_by_plugin(dataset: Any, described: Slice, frames: int) -> Iterator[NDArray[Any]]:
    syntax = dataset.file_meta.TransferSyntaxUID
    try:
        decoder = get_decoder(syntax)
    except NotImplementedError:
        raise BadInput(f"its transfer syntax {syntax.name} is not read; {_ADVICE}.") from None
    if not decoder.is_available:
        wanted = " or ".join(decoder.missing_dependencies)
        raise BadInput(
            f"its transfer syntax {syntax.name} needs a decoder that is not installed ({wanted}); install it, "
            f"or {_ADVICE}."
        )
    if syntax.is_encapsulated:
        for content in generate_frames(dataset.PixelData, number_of_frames=frames):
            if syntax in _JPEG_PROCESSES:
                _checked_jpeg(content, dataset)
            else:
                _check_codestream(content, described.shape)
    try:
        yield from iter_pixels(dataset)
    except RuntimeError as error:
        reason = str(error).splitlines()[-1].strip().rstrip(".")
        raise BadInput(f"its {syntax.name} pixels are damaged ({reason}), so get the file again.") from error


def _checked_jpeg(content: bytes, dataset: Any) -> JpegFrame:
    """A JPEG frame's header, as the transfer syntax and the rest of the file announce it."""
    frame = read_jpeg_frame(content)
    syntax = dataset.file_meta.TransferSyntaxUID
    if frame.process not in _JPEG_PROCESSES[syntax]:
        raise BadInput(f"its pixels are not coded as its transfer syntax {syntax.name} says; {_ADVICE}.")
    stated = (int(dataset.Columns), int(dataset.Rows))
    if (frame.columns, frame.rows) != stated:
        raise _another_size("JPEG", (frame.columns, frame.rows), stated)
    if frame.precision > dataset.BitsAllocated:
        raise BadInput(
            f"its JPEG image has {frame.precision} bits a pixel, its header says {dataset.BitsAllocated}; "
            "one of them is wrong, so get the file again."
        )
    return frame


def _check_codestream(content: bytes, stated: tuple[int, int]) -> None:
    """A JPEG 2000 codestream has a size of its own, by which its decoder allocates."""
    start = content.find(_CODESTREAM)
    if start < 0:
        return
    # After marker, length and capabilities: the extent and the offset of the image, four bytes each.
    x_end, y_end, x_start, y_start = np.frombuffer(content[start + 8 : start + 24], dtype=">u4").tolist()
    if (x_end - x_start, y_end - y_start) != stated:
        raise _another_size("JPEG 2000", (x_end - x_start, y_end - y_start), stated)


def _another_size(kind: str, found: tuple[int, int], stated: tuple[int, int]) -> BadInput:
    return BadInput(
        f"its {kind} image has {found[0]} × {found[1]} pixels, its header says {stated[0]} × {stated[1]}; "
        "one of them is wrong, so get the file again."
    )

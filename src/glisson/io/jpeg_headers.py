"""What a JPEG or JPEG-LS frame says of itself, read strictly before any decoder sees it.

Decoders trust a frame: they allocate by its own size, and on damage some return noise, some never return.

Reference: ITU-T T.81 (JPEG) annex B and T.87 (JPEG-LS) annex C; frames of one component in one scan.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from glisson.core import BadInput
from glisson.core.arrays import IntArray

BASELINE, EXTENDED, LOSSLESS, JPEG_LS = 0xC0, 0xC1, 0xC3, 0xF7
"""Start-of-frame markers: sequential DCT of 8 bits, of 8 or 12 bits, lossless prediction, and JPEG-LS."""

_START, _END = b"\xff\xd8", b"\xff\xd9"
_PADDING = b"\0\xff"  # up to an even length: zero by DICOM, but FF is seen too
_HUFFMAN_TABLES, _QUANTISATION_TABLES, _RESTART_INTERVAL, _SCAN = 0xC4, 0xDB, 0xDD, 0xDA
_STARTS_OF_FRAME = {*range(0xC0, 0xD0), JPEG_LS} - {_HUFFMAN_TABLES, 0xC8, 0xCC}
_STRAY_MARKER = re.compile(rb"\xff[^\x00\xff\xd0-\xd7]")
_STRAY_MARKER_LS = re.compile(rb"\xff[\x80-\xcf\xd8-\xff]")  # a zero bit is stuffed after FF, not a byte


@dataclass(frozen=True, eq=False)
class JpegFrame:
    """A frame of one component, in the terms of T.81.

    `huffman_tables` are the numbers of codes of each length and the symbols, by 16 · class + destination;
    `quantisation_tables` hold 64 steps in zigzag order, by destination. `scan` is the destinations of DC and AC
    table in one byte, then Ss (for lossless the predictor), Se, and Ah and Al in one byte.
    """

    process: int
    precision: int
    rows: int
    columns: int
    quantisation: int
    huffman_tables: Mapping[int, bytes]
    quantisation_tables: Mapping[int, IntArray]
    restart_interval: int
    scan: bytes
    entropy_coded: bytes


def damaged(reason: str) -> BadInput:
    """The sentence on a frame that contradicts itself."""
    return BadInput(f"its JPEG pixels are damaged ({reason}), so get the file again.")


def read_jpeg_frame(content: bytes) -> JpegFrame:
    """Read all of a frame but its pixels.

    Args:
        content: from the start to the end of the image; padding may follow.

    Raises:
        BadInput: cut off, not JPEG, contradictory, or of several components or scans.
    """
    content = _trimmed(content)
    headers: dict[int, bytes] = {}
    huffman: dict[int, bytes] = {}
    quantisation: dict[int, IntArray] = {}
    segments = list(_segments(content))
    for marker, segment, _ in segments:
        if marker == _HUFFMAN_TABLES:
            huffman |= _huffman_tables(segment)
        elif marker == _QUANTISATION_TABLES:
            quantisation |= _quantisation_tables(segment)
        elif marker in headers:
            raise damaged("a header comes twice")
        elif marker in _STARTS_OF_FRAME or marker in (_SCAN, _RESTART_INTERVAL):
            headers[marker] = segment
    starts = [marker for marker in headers if marker in _STARTS_OF_FRAME]
    if len(starts) != 1:
        raise damaged("one frame header is needed")
    start, scan = headers[starts[0]], headers[_SCAN]
    if len(start) != 9 or start[5] != 1 or len(scan) != 6 or scan[0] != 1:
        raise damaged("they are not of one component in one scan")
    stray = _STRAY_MARKER_LS if starts[0] == JPEG_LS else _STRAY_MARKER
    entropy_coded = content[segments[-1][2] : -len(_END)].rstrip(b"\xff")  # fill bytes
    if stray.search(entropy_coded):
        raise damaged("a marker stands amid them")
    return JpegFrame(
        process=starts[0],
        precision=start[0],
        rows=int.from_bytes(start[1:3]),
        columns=int.from_bytes(start[3:5]),
        quantisation=start[8],
        huffman_tables=huffman,
        quantisation_tables=quantisation,
        restart_interval=int.from_bytes(headers.get(_RESTART_INTERVAL, b"")),
        scan=scan[2:],
        entropy_coded=entropy_coded,
    )


def _trimmed(content: bytes) -> bytes:
    """From the start marker to the end marker."""
    content = content.rstrip(_PADDING)
    if not content.startswith(_START):
        raise damaged("they do not start as JPEG does")
    if not content.endswith(_END):
        raise damaged("they are cut off")
    return content


def _segments(content: bytes) -> Iterator[tuple[int, bytes, int]]:
    """Marker, content and end of each segment, up to the scan's header."""
    position, marker = len(_START), 0
    while marker != _SCAN:
        while content[position : position + 2] == b"\xff\xff":
            position += 1
        introduction = content[position : position + 4]
        marker, length = introduction[1], int.from_bytes(introduction[2:])
        end = position + 2 + length
        if introduction[0] != 0xFF or not 0xC0 <= marker <= 0xFE or 0xD0 <= marker <= 0xD9 or length < 2:
            raise damaged("a marker is missing")
        if end > len(content) - len(_END):
            raise damaged("a header is cut off")
        yield marker, content[position + 4 : end], end
        position = end


def _huffman_tables(segment: bytes) -> dict[int, bytes]:
    tables = {}
    while segment:
        end = 17 + sum(segment[1:17])
        if len(segment) < end:
            raise damaged("a Huffman table is cut off")
        tables[segment[0]] = segment[1:end]
        segment = segment[end:]
    return tables


def _quantisation_tables(segment: bytes) -> dict[int, IntArray]:
    tables = {}
    while segment:
        kind = np.dtype(">u2" if segment[0] >> 4 else "u1")
        end = 1 + 64 * kind.itemsize
        if len(segment) < end:
            raise damaged("a quantisation table is cut off")
        tables[segment[0] & 15] = np.frombuffer(segment[1:end], dtype=kind).astype(np.int64)
        segment = segment[end:]
    return tables

"""Huffman codes of JPEG: tables, restart segments, and the bits in them.

Reference: ITU-T T.81 annexes C and F.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.geometry.compiled import compiled
from glisson.io.jpeg_headers import JpegFrame, damaged

_RESTART = re.compile(rb"\xff([\xd0-\xd7])")
_MARGIN = 8  # zero bytes after a segment: a code and what it announces may be read before its end is noticed


@dataclass(frozen=True, eq=False)
class HuffmanTable:
    """Length of the code that any 16 bits begin with (0: none does) and its symbol, uint8 arrays (65536,)."""

    lengths: NDArray[np.uint8]
    symbols: NDArray[np.uint8]


def huffman_table(frame: JpegFrame, destination: int, largest: int) -> HuffmanTable:
    """Unfold one of a frame's tables (T.81, C.2).

    Args:
        frame: where the table is defined.
        destination: 16 · class + destination.
        largest: greatest symbol that means something.

    Raises:
        BadInput: there is no such table, or it is impossible.
    """
    definition = frame.huffman_tables.get(destination)
    if definition is None:
        raise damaged("a Huffman table is missing")
    lengths, symbols = np.zeros(1 << 16, dtype=np.uint8), np.zeros(1 << 16, dtype=np.uint8)
    code_lengths = np.repeat(np.arange(1, 17), list(definition[:16]))
    start = 0
    for length, symbol in zip(code_lengths.tolist(), definition[16:], strict=True):
        end = start + (1 << (16 - length))
        if end > lengths.size or symbol > largest:
            raise damaged("a Huffman table is impossible")
        lengths[start:end], symbols[start:end] = length, symbol
        start = end
    return HuffmanTable(lengths, symbols)


def restart_segments(frame: JpegFrame, units: int) -> Iterator[tuple[NDArray[np.uint8], int]]:
    """Bytes between restart markers, without stuffing and with a margin of zeros, and how many units each codes.

    Args:
        frame: whose entropy-coded bytes are taken.
        units: blocks or samples in the whole frame.

    Raises:
        BadInput: restart markers are missing or out of order.
    """
    interval = frame.restart_interval or units
    segments = _RESTART.split(frame.entropy_coded)
    markers = [bytes([0xD0 + number % 8]) for number in range(-(-units // interval) - 1)]
    if segments[1::2] != markers:
        raise damaged("restart markers are missing")
    for number, segment in enumerate(segments[::2]):
        plain = segment.rstrip(b"\xff").replace(b"\xff\0", b"\xff") + bytes(_MARGIN)
        yield np.frombuffer(plain, dtype=np.uint8), min(interval, units - number * interval)


def check_end(segment: NDArray[np.uint8], position: int) -> None:
    """Whether a segment was read to its last byte.

    Args:
        segment: as `restart_segments` gives it.
        position: first bit that was not read; -1 where no code fits.

    Raises:
        BadInput: it ends too early or too late, or has an unknown code.
    """
    left = bits_in(segment) - position
    if position < 0:
        raise damaged("they hold an unknown code")
    if left < 0:
        raise damaged("they end before the last pixel")
    if left >= 8:
        raise damaged("they go on after the last pixel")


@compiled
def bits_in(segment: NDArray[np.uint8]) -> int:
    """Number of coded bits in a segment, with those that fill its last byte."""
    return 8 * (segment.size - _MARGIN)


@compiled
def bits_at(segment: NDArray[np.uint8], position: int, count: int) -> int:
    """The up to 16 bits from a position on, as a number."""
    byte = position >> 3
    window = (int(segment[byte]) << 16) | (int(segment[byte + 1]) << 8) | int(segment[byte + 2])
    return (window >> (24 - (position & 7) - count)) & ((1 << count) - 1)


@compiled
def extended(bits: int, size: int) -> int:
    """The signed number that `size` bits stand for (T.81, F.2.2.1)."""
    return bits if size == 0 or bits >> (size - 1) else bits - (1 << size) + 1

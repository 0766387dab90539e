"""JPEG Extended with 12 bits: blocks of 8 × 8 samples as quantised cosine coefficients.

It is decoded here because of pydicom's plug-ins those under a permissive licence decode 8 bits only.

Reference: ITU-T T.81 annexes A and F (sequential DCT, Huffman coding; processes 2 and 4).
"""

import numpy as np
from numpy.typing import NDArray
from scipy.fft import idctn

from glisson.core.arrays import IntArray
from glisson.geometry.compiled import compiled
from glisson.io.jpeg_headers import JpegFrame, damaged
from glisson.io.jpeg_huffman import bits_at, bits_in, check_end, extended, huffman_table, restart_segments

_ZIGZAG = sorted(range(64), key=lambda n: (n // 8 + n % 8, n // 8 if (n // 8 + n % 8) % 2 else n % 8))
"""Places in a block of 8 × 8 (T.81, figure A.6)."""


def decoded_extended(frame: JpegFrame) -> NDArray[np.uint16]:
    """Samples (rows, columns) of a sequential DCT frame of 8 or 12 bits.

    Raises:
        BadInput: damaged.
    """
    # The scan's band is always 0 to 63 here; encoders are known to write others, which mean nothing.
    steps = frame.quantisation_tables.get(frame.quantisation)
    if steps is None or frame.precision not in (8, 12):
        raise damaged("their header is impossible")
    across, down = -(-frame.columns // 8), -(-frame.rows // 8)
    blocks = np.zeros((down * across, 64))
    blocks[:, _ZIGZAG] = _coefficients(frame, down * across) * steps
    samples = idctn(blocks.reshape(-1, 8, 8), axes=(1, 2), norm="ortho") + (1 << (frame.precision - 1))
    image = samples.reshape(down, across, 8, 8).swapaxes(1, 2).reshape(8 * down, 8 * across)
    whole: NDArray[np.float64] = np.rint(image[: frame.rows, : frame.columns])
    return whole.clip(0, (1 << frame.precision) - 1).astype(np.uint16)


def _coefficients(frame: JpegFrame, count: int) -> IntArray:
    """Quantised coefficients (blocks, 64) in zigzag order."""
    dc = huffman_table(frame, frame.scan[0] >> 4, largest=15)
    ac = huffman_table(frame, 16 + (frame.scan[0] & 15), largest=255)
    parts = []
    for segment, blocks in restart_segments(frame, count):
        part, position = _blocks(segment, blocks, dc.lengths, dc.symbols, ac.lengths, ac.symbols)
        check_end(segment, position)
        parts.append(part)
    return np.concatenate(parts)


@compiled
def _blocks(
    segment: NDArray[np.uint8],
    count: int,
    dc_lengths: NDArray[np.uint8],
    dc_symbols: NDArray[np.uint8],
    ac_lengths: NDArray[np.uint8],
    ac_symbols: NDArray[np.uint8],
) -> tuple[IntArray, int]:
    """Blocks of one restart segment (T.81, F.2.2), and the position after them (-1: an unknown code)."""
    blocks = np.zeros((count, 64), dtype=np.int64)
    end = bits_in(segment)
    position, mean = 0, 0
    for block in range(count):
        index = 0
        while index < 64:
            if position > end:
                return blocks, position
            code = bits_at(segment, position, 16)
            length = int(ac_lengths[code] if index else dc_lengths[code])
            symbol = int(ac_symbols[code] if index else dc_symbols[code])
            index += symbol >> 4  # zeros before this coefficient
            if length == 0 or index > 63:
                return blocks, -1
            position += length
            size = symbol & 15
            if index and symbol == 0:  # zeros up to the end of the block
                break
            value = extended(bits_at(segment, position, size), size)
            position += size
            if index == 0:
                mean += value
                value = mean
            blocks[block, index] = value
            index += 1
    return blocks, position

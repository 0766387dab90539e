"""JPEG Lossless: each sample is coded as its difference from a prediction by its neighbours.

It is decoded here because pylibjpeg-libjpeg is under the GPL, and GDCM's package carries a library that is
(socket++) and takes most damage in silence. Here every code must be known and every byte used.

Reference: ITU-T T.81 annex H (Huffman coding; process 14).
"""

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import IntArray
from glisson.geometry.compiled import compiled
from glisson.io.jpeg_headers import JpegFrame, damaged
from glisson.io.jpeg_huffman import bits_at, bits_in, check_end, extended, huffman_table, restart_segments


def decoded_lossless(frame: JpegFrame) -> NDArray[np.uint16]:
    """Samples (rows, columns) of a lossless frame, as coded: a signed pixel in two's complement.

    Raises:
        BadInput: damaged.
    """
    destinations, predictor, _, approximation = frame.scan
    point_transform = approximation & 15
    precision = frame.precision - point_transform
    if not 1 <= predictor <= 7 or not 1 <= precision <= 16 or frame.restart_interval % frame.columns:
        raise damaged("their header is impossible")
    table = huffman_table(frame, destinations >> 4, largest=16)
    parts = []
    for segment, count in restart_segments(frame, frame.rows * frame.columns):
        differences, position = _differences(segment, count, table.lengths, table.symbols)
        check_end(segment, position)
        parts.append(_predicted(differences.reshape(-1, frame.columns), predictor, 1 << (precision - 1)))
    samples = np.concatenate(parts)
    if samples.max() >> precision:
        raise damaged(f"they exceed {precision} bits")
    return (samples << point_transform).astype(np.uint16)


@compiled
def _differences(
    segment: NDArray[np.uint8], count: int, lengths: NDArray[np.uint8], symbols: NDArray[np.uint8]
) -> tuple[IntArray, int]:
    """Differences of one restart segment (T.81, H.1.2.2), and the position after them (-1: an unknown code)."""
    differences = np.zeros(count, dtype=np.int64)
    end = bits_in(segment)
    position = 0
    for index in range(count):
        if position > end:
            break
        code = bits_at(segment, position, 16)
        if lengths[code] == 0:
            return differences, -1
        position += int(lengths[code])
        size = int(symbols[code])
        if size == 16:  # the one difference of this size is not coded further
            differences[index] = 32768
        else:
            differences[index] = extended(bits_at(segment, position, size), size)
            position += size
    return differences, position


@compiled
def _predicted(differences: IntArray, predictor: int, first: int) -> IntArray:
    """Samples from differences (lines, columns) of one restart segment, modulo 2¹⁶ (T.81, table H.1)."""
    samples = np.zeros_like(differences)
    lines, columns = differences.shape
    for line in range(lines):
        for column in range(columns):
            left = samples[line, column - 1] if column else np.int64(first)
            prediction = left
            if line:
                above = samples[line - 1, column]
                corner = samples[line - 1, column - 1] if column else above
                if column == 0 or predictor == 2:
                    prediction = above
                elif predictor == 3:
                    prediction = corner
                elif predictor == 4:
                    prediction = left + above - corner
                elif predictor == 5:
                    prediction = left + ((above - corner) >> 1)
                elif predictor == 6:
                    prediction = above + ((left - corner) >> 1)
                elif predictor == 7:
                    prediction = (left + above) >> 1
            samples[line, column] = (prediction + differences[line, column]) & 0xFFFF
    return samples

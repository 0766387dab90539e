"""Types of liver resection by Couinaud's segments, what each removes, and what remains.

Dissertation, section 2.3.1 and Table 1: a resection has segments that it removes and others to which it can extend;
one of three or more segments is major, one of a single segment or of two that adjoin is minor.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from glisson.core.arrays import IntArray
from glisson.core.errors import BadInput
from glisson.core.image import LabelMap

SEGMENTS = tuple(range(1, 9))
_MAJOR = 3


@dataclass(frozen=True)
class ResectionType:
    """Numbers of the segments that are always removed, and of those to which the resection may extend."""

    name: str
    removed: tuple[int, ...]
    extendable: tuple[int, ...] = ()

    def variants(self) -> Iterator["Resection"]:
        """The resection alone, then with every choice of its extensions, the smaller ones first."""
        for count in range(len(self.extendable) + 1):
            for more in combinations(self.extendable, count):
                added = "" if not more else f" extended to {_listed(more)}"
                yield Resection(f"{self.name}{added}", tuple(sorted((*self.removed, *more))))


TABLE_1 = (
    ResectionType("right liver resection", (5, 6, 7, 8), (1, 4)),
    ResectionType("left liver resection", (2, 3, 4), (1, 5, 8)),
    ResectionType("left lobectomy", (2, 3)),
)
"""The dissertation's Table 1; its bisegmentectomy of 2 and 3 is the left lobectomy."""


@dataclass(frozen=True)
class Resection:
    """Numbers of the segments that are removed, in order."""

    name: str
    removed: tuple[int, ...]

    @property
    def is_major(self) -> bool:
        """Whether three or more segments are removed."""
        return len(self.removed) >= _MAJOR


@dataclass(frozen=True)
class ResectionVolumes:
    """What a resection takes and leaves, in ml, of a liver whose segments are known."""

    resection: Resection
    removed_ml: float
    remnant_ml: float

    @property
    def remnant_share(self) -> float:
        """Future remnant over the whole liver, 0 to 1."""
        return self.remnant_ml / (self.remnant_ml + self.removed_ml)


def resections(segments: LabelMap) -> tuple[Resection, ...]:
    """All of Table 1 with all extensions, every single segment, and every other pair that adjoins in this liver.

    Args:
        segments: labels 1 to 8 are Couinaud's segments.
    """
    table = [variant for kind in TABLE_1 for variant in kind.variants()]
    single = [Resection(f"segment {number}", (number,)) for number in SEGMENTS]
    named = {resection.removed for resection in table}
    pairs = [Resection(f"segments {_listed(pair)}", pair) for pair in adjoining_pairs(segments) if pair not in named]
    return (*table, *single, *pairs)


def resection_volumes(segments: LabelMap) -> tuple[ResectionVolumes, ...]:
    """Volumes of all `resections`; removed and remnant together are the whole liver.

    Raises:
        BadInput: a label is no segment, or one of the eight is missing.
    """
    counts = _counts(segments)
    voxel_ml = segments.grid.voxel_volume_mm3 * 1e-3
    whole = int(counts.sum())
    found = []
    for resection in resections(segments):
        removed = int(counts[list(resection.removed)].sum())
        found.append(ResectionVolumes(resection, removed * voxel_ml, (whole - removed) * voxel_ml))
    return tuple(found)


def adjoining_pairs(segments: LabelMap) -> tuple[tuple[int, int], ...]:
    """Pairs of segments (the smaller number first) with voxels that share a face."""
    voxels, found = segments.voxels, set()
    for axis in range(3):
        before = np.take(voxels, range(voxels.shape[axis] - 1), axis=axis)
        after = np.take(voxels, range(1, voxels.shape[axis]), axis=axis)
        meeting = (before != after) & (before != 0) & (after != 0)
        pairs = np.sort(np.stack([before[meeting], after[meeting]], axis=1), axis=1)
        found |= {(int(a), int(b)) for a, b in np.unique(pairs, axis=0)}
    return tuple(sorted(found))


def _counts(segments: LabelMap) -> IntArray:
    """Voxels of each label from 0 to 8, those of 0 being none."""
    voxels = segments.voxels
    if voxels.min() < 0 or voxels.max() > SEGMENTS[-1]:
        raise BadInput(f"Couinaud's segments are numbered 1 to 8, but the label map has {int(voxels.max())}.")
    counts = np.bincount(voxels.ravel(), minlength=SEGMENTS[-1] + 1)
    missing = [number for number in SEGMENTS if counts[number] == 0]
    if missing:
        raise BadInput(f"The label map has no voxel of segment {_listed(tuple(missing))}; check the landmarks.")
    counts[0] = 0
    return counts


def _listed(numbers: tuple[int, ...]) -> str:
    *first, last = map(str, numbers)
    return f"{', '.join(first)} and {last}" if first else last

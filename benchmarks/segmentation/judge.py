"""The neutral judge: `python judge.py MESH OUT MASK…` writes a JSON list with an entry for each.

Counted is what hangs together with the start: a contour without places far from it would have found that alone.
"""

import json
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from problem import Problem, load_problem
from scipy import ndimage


def judge(problem: Problem, masks: list[NDArray[np.bool_]]) -> list[dict[str, float | None]]:
    """Of each mask its Dice, and how far (mm) the true border and its own are from each other on average."""
    return [_scores(problem, mask) for mask in masks]


def _scores(problem: Problem, mask: NDArray[np.bool_]) -> dict[str, float | None]:
    parts, _ = ndimage.label(mask)
    touched = np.unique(parts[problem.start & mask])
    found = np.isin(parts, touched[touched > 0])
    if not found.any():
        return {"dice": 0.0, "difference": None}
    dice = 2.0 * float((found & problem.truth).sum()) / float(found.sum() + problem.truth.sum())
    ours, true = _border(found), _border(problem.truth)
    away = np.concatenate([_distance(true, problem)[ours], _distance(ours, problem)[true]])
    return {"dice": dice, "difference": float(away.mean())}


def _border(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    border: NDArray[np.bool_] = mask & ~ndimage.binary_erosion(mask)
    return border


def _distance(border: NDArray[np.bool_], problem: Problem) -> NDArray[np.float64]:
    distance: NDArray[np.float64] = ndimage.distance_transform_edt(~border, sampling=problem.spacing_mm)
    return distance


if __name__ == "__main__":
    answers = [np.load(name)["mask"] for name in sys.argv[3:]]
    Path(sys.argv[2]).write_text(json.dumps(judge(load_problem(Path(sys.argv[1])), answers)))

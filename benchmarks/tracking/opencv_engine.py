"""OpenCV by itself: `python opencv_engine.py flow|decode VIDEO OUT`."""

import sys
from pathlib import Path

import cv2
import numpy as np
from adapter import Places, run

_BACK_PX = 1.0


def flow(path: Path, marks: Places, most: int | None) -> Places:
    """Pyramidal Lucas–Kanade there and back; a mark that is lost stays so."""
    capture = cv2.VideoCapture(str(path))
    now, alive = marks.astype(np.float32), np.ones(len(marks), dtype=bool)
    before, places = None, []
    while most is None or len(places) < most:
        good, image = capture.read()
        if not good:
            break
        grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        if before is not None:
            there, _, _ = cv2.calcOpticalFlowPyrLK(before, grey, now, None)
            back, _, _ = cv2.calcOpticalFlowPyrLK(grey, before, there, None)
            alive &= np.linalg.norm(back - now, axis=1) < _BACK_PX
            now = there
        places.append(np.where(alive[:, None], now, np.nan))
        before = grey
    return np.array(places, dtype=np.float64)


def decode(path: Path, marks: Places, most: int | None) -> None:
    """Only what it costs to read the frames."""
    capture = cv2.VideoCapture(str(path))
    count = 0
    while (most is None or count < most) and capture.read()[0]:
        count += 1


if __name__ == "__main__":
    run(cv2.__version__, flow if sys.argv[1] == "flow" else decode)

"""Video frame by frame, whatever OpenCV's FFmpeg reads; and written as motion JPEG."""

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from glisson.core.errors import BadInput
from glisson.core.protocols import Progress, silent
from glisson.io.atomic import WriteFailed, atomic_path

# What is wrong with a file is told in a sentence; words of FFmpeg and OpenCV on stderr help nobody. FFmpeg's variable
# is read when the first file is opened.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

_JPEG_QUALITY = 95.0


@dataclass(frozen=True, eq=False)
class Frame:
    """A picture [row, column, red green blue] of a video, and its time in s from the first one."""

    time_s: float
    image: NDArray[np.uint8]


class Video:
    """A video file, read once from its beginning; `with open_video(path) as video: for frame in video: …`.

    `frames_per_s` and `announced` are what the file says of its rate and of its number of frames (0: nothing).
    """

    def __init__(self, path: Path, capture: "cv2.VideoCapture", progress: Progress) -> None:
        self.path = path
        self._capture, self._progress = capture, progress
        self.width = int(capture.get(cv2.CAP_PROP_FRAME_WIDTH))
        self.height = int(capture.get(cv2.CAP_PROP_FRAME_HEIGHT))
        rate = float(capture.get(cv2.CAP_PROP_FPS))
        self.frames_per_s = rate if np.isfinite(rate) and rate > 0.0 else 25.0
        self.announced = max(int(capture.get(cv2.CAP_PROP_FRAME_COUNT)), 0)
        self.read = 0
        """Frames read so far."""

    def __enter__(self) -> "Video":
        return self

    def __exit__(self, *_: object) -> None:
        self._capture.release()

    def __iter__(self) -> Iterator[Frame]:
        """The frames that are left, up to the end or to where the file cannot be read any further."""
        last = -1.0
        while True:
            good, picture = self._capture.read()
            if not good:
                return
            # Cameras that skip frames say so in the stamps; some files have none, or the same one for all.
            stamp = float(self._capture.get(cv2.CAP_PROP_POS_MSEC)) / 1000.0
            if not (np.isfinite(stamp) and stamp > last):
                stamp = 0.0 if self.read == 0 else last + 1.0 / self.frames_per_s
            last = stamp
            self.read += 1
            self._progress(min(self.read / self.announced, 1.0) if self.announced else None, f"frame {self.read}")
            yield Frame(stamp, np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB, picture), dtype=np.uint8))

    @property
    def early_end(self) -> str | None:
        """After the last frame: a sentence where the file has fewer frames than it announces."""
        # Some writers count a frame or two that were never written.
        if self.read >= self.announced - 2:
            return None
        return (
            f"{self.path} ends early: {self.read} of the {self.announced} frames that it announces can be read; "
            "what follows is of these alone."
        )


def open_video(path: str | Path, progress: Progress = silent) -> Video:
    """Open a video; `progress` is told of each frame that is read.

    Raises:
        BadInput: there is no such file, or it is no video that can be read.
    """
    file = Path(path)
    if not file.is_file():
        raise BadInput(f"There is no video {file}.")
    # Only FFmpeg: the other readers take a file of pictures with numbers in their names for a video.
    with _silent():
        capture = cv2.VideoCapture(str(file), cv2.CAP_FFMPEG)
    if not capture.isOpened():
        raise BadInput(
            f"{file} cannot be read as a video: it is of an unknown kind, or its end with the index is missing; "
            "copy it again, or convert it to MP4."
        )
    return Video(file, capture, progress)


@contextmanager
def _silent() -> Iterator[None]:
    logging = cv2.utils.logging
    before = logging.getLogLevel()
    logging.setLogLevel(logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        logging.setLogLevel(before)


def write_video(path: str | Path, images: Iterable[NDArray[np.uint8]], frames_per_s: float) -> int:
    """Write pictures [row, column, red green blue] of one size as motion JPEG (`.avi`); their number; atomic.

    Raises:
        BadInput: there is no picture, or the place cannot be written.
        WriteFailed: the disk is full.
    """
    file = Path(path)
    if file.suffix != ".avi":
        raise BadInput(f"A video is written as .avi, not as {file.name}.")
    count = 0
    writer: cv2.VideoWriter | None = None
    with atomic_path(file) as temporary:
        try:
            for image in images:
                if writer is None:
                    writer = _writer(temporary, image.shape[1], image.shape[0], frames_per_s)
                writer.write(cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
                count += 1
        finally:
            if writer is not None:
                writer.release()
        if count == 0:
            raise BadInput(f"{file} was not written: a video needs at least one picture.")
    return count


def _writer(path: Path, width: int, height: int, frames_per_s: float) -> "cv2.VideoWriter":
    code = cv2.VideoWriter.fourcc(*"MJPG")
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, code, frames_per_s, (width, height))
    if not writer.isOpened():
        raise WriteFailed(f"{path} could not be written as a video.")
    with suppress(cv2.error):
        writer.set(cv2.VIDEOWRITER_PROP_QUALITY, _JPEG_QUALITY)
    return writer

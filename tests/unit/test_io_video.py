"""Videos: frames and times as written, files that end early or cannot be read."""

import cv2
import numpy as np
import pytest

from glisson.core.errors import BadInput
from glisson.io.video import open_video, write_video


def pictures(count=12, width=96, height=64):
    down, across = np.mgrid[:height, :width]
    for n in range(count):
        yield np.stack([2 * across + n, 3 * down, np.full_like(down, 10 * n)], axis=-1).clip(0, 255).astype(np.uint8)


def test_frames_come_back_with_their_times(tmp_path):
    path = tmp_path / "clip.avi"
    assert write_video(path, pictures(), 50.0) == 12
    said = []
    with open_video(path, lambda fraction, words: said.append(fraction)) as video:
        frames = list(video)
    assert (video.width, video.height, video.announced, video.read) == (96, 64, 12, 12)
    assert video.early_end is None
    np.testing.assert_allclose([frame.time_s for frame in frames], np.arange(12) / 50.0, atol=1e-3)
    for frame, image in zip(frames, pictures(), strict=True):
        assert np.abs(frame.image.astype(int) - image).mean() < 4.0
    assert said[-1] == 1.0


def test_a_torn_file_is_read_as_far_as_it_goes_and_says_so(tmp_path):
    whole, torn = tmp_path / "clip.avi", tmp_path / "torn.avi"
    write_video(whole, pictures(40), 25.0)
    torn.write_bytes(whole.read_bytes()[: whole.stat().st_size * 6 // 10])
    with open_video(torn) as video:
        assert 10 < len(list(video)) < 36
    assert "ends early" in video.early_end
    assert "of the 40 frames" in video.early_end


@pytest.mark.parametrize("content", [b"", b"no video at all", b"\x00" * 4096])
def test_what_is_no_video_is_one_sentence(tmp_path, content, capfd):
    path = tmp_path / "clip.mp4"
    path.write_bytes(content)
    with pytest.raises(BadInput, match="cannot be read as a video"):
        open_video(path)
    assert capfd.readouterr().err == ""


def test_an_mp4_without_its_index_is_one_sentence(tmp_path):
    whole, torn = tmp_path / "clip.mp4", tmp_path / "torn.mp4"
    writer = cv2.VideoWriter(str(whole), cv2.VideoWriter.fourcc(*"mp4v"), 25.0, (96, 64))
    for image in pictures():
        writer.write(image)
    writer.release()
    torn.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    with pytest.raises(BadInput, match="index is missing"):
        open_video(torn)


def test_no_file_no_picture_and_another_suffix(tmp_path):
    with pytest.raises(BadInput, match="There is no video"):
        open_video(tmp_path / "none.avi")
    with pytest.raises(BadInput, match="at least one picture"):
        write_video(tmp_path / "none.avi", [], 25.0)
    with pytest.raises(BadInput, match=r"\.avi"):
        write_video(tmp_path / "clip.mp4", pictures(), 25.0)
    assert list(tmp_path.iterdir()) == []

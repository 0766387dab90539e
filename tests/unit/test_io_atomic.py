import errno
import os
import shutil
import subprocess

import numpy as np
import pytest

from glisson.core import BadInput, Board, ContactLaw, Grid, LabelMap, Scenario, Stage, TriangleSurface, Volume
from glisson.io import atomic
from glisson.io.atomic import WriteFailed, atomic_folder, atomic_path, atomic_paths
from glisson.io.images import write_labels, write_volume
from glisson.io.scenario_files import write_scenario
from glisson.io.surfaces import write_surface

GRID = Grid((20, 20, 20), [1, 1, 1], [0, 0, 0])
VOLUME = Volume(np.random.default_rng(0).integers(-9999, 9999, GRID.shape).astype(np.int16), GRID)
TRIANGLE = TriangleSurface([[0, 0, 0], [9, 0, 0], [0, 9, 0]], [[0, 1, 2]])
SCENARIO = Scenario((Board("board", [0, 0, 0], [0, -1, 0]),), (Stage("rest", ContactLaw()),))

WRITERS = {
    "ct.nii.gz": lambda path: write_volume(path, VOLUME),
    "ct.nii": lambda path: write_volume(path, VOLUME),
    "ct.nrrd": lambda path: write_volume(path, VOLUME),
    "l.nii.gz": lambda path: write_labels(path, LabelMap(np.ones(GRID.shape, np.uint8), GRID, {1: "liver"})),
    "s.stl": lambda path: write_surface(path, TRIANGLE),
    "s.vtp": lambda path: write_surface(path, TRIANGLE),
    "s.ply": lambda path: write_surface(path, TRIANGLE),
    "scenario.toml": lambda path: write_scenario(path, SCENARIO),
}


BIG = Grid((64, 64, 64), [1, 1, 1], [0, 0, 0])
NOISE = Volume(np.random.default_rng(0).integers(-9999, 9999, BIG.shape).astype(np.int16), BIG)


def half_written(context, thrown):
    """Write something inside an atomic context, then be interrupted."""
    with context as temporary:
        for path in temporary if isinstance(temporary, tuple) else (temporary,):
            (path / "a" if path.is_dir() else path).write_text("half")
        raise thrown


def names(folder):
    return sorted(entry.name for entry in folder.iterdir())


def test_a_file_appears_whole(tmp_path):
    target = tmp_path / "new" / "a.nii.gz"
    with atomic_path(target) as temporary:
        assert temporary.name.endswith(".nii.gz")
        assert temporary.parent == target.parent
        temporary.write_text("good")
        assert not target.exists()
    assert target.read_text() == "good"
    assert names(target.parent) == ["a.nii.gz"]


@pytest.mark.parametrize("thrown", [KeyboardInterrupt, ValueError, SystemExit])
def test_an_interruption_leaves_the_old_file(tmp_path, thrown):
    target = tmp_path / "a.txt"
    target.write_text("old")
    with pytest.raises(thrown):
        half_written(atomic_path(target), thrown)
    assert target.read_text() == "old"
    assert names(tmp_path) == ["a.txt"]


def test_several_files_change_together(tmp_path):
    one, two = tmp_path / "a.vtu", tmp_path / "a.json"
    one.write_text("old"), two.write_text("old")
    with pytest.raises(KeyboardInterrupt):
        half_written(atomic_paths(one, two), KeyboardInterrupt)
    assert one.read_text() == two.read_text() == "old"
    with atomic_paths(one, two) as (first, second):
        first.write_text("new"), second.write_text("new")
    assert one.read_text() == two.read_text() == "new"
    assert names(tmp_path) == ["a.json", "a.vtu"]


@pytest.mark.parametrize("fresh", [True, False])
@pytest.mark.parametrize("failing", [1, 2])
def test_an_interruption_between_the_renames_of_a_pair(tmp_path, monkeypatch, fresh, failing):
    one, two = tmp_path / "a.vtu", tmp_path / "a.json"
    if not fresh:
        one.write_text("old"), two.write_text("old")
    replace, calls = os.replace, []

    def fails_once(source, destination):
        calls.append(source)
        if len(calls) == failing:
            raise KeyboardInterrupt
        replace(source, destination)

    monkeypatch.setattr(os, "replace", fails_once)
    with pytest.raises(KeyboardInterrupt), atomic_paths(one, two) as (first, second):
        first.write_text("new"), second.write_text("new")
    assert [path.read_text() for path in tmp_path.iterdir()] == ([] if fresh else ["old", "old"])


def test_flushed_before_renamed(tmp_path, monkeypatch):
    order = []
    flush, replace = os.fsync, os.replace
    monkeypatch.setattr(os, "fsync", lambda fd: (order.append("flush"), flush(fd)))
    monkeypatch.setattr(os, "replace", lambda a, b: (order.append("rename"), replace(a, b)))
    with atomic_path(tmp_path / "a") as temporary:
        temporary.write_text("x")
    assert order == ["flush", "rename", "flush"]  # the file, its name, the folder that holds the name


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EDQUOT])
def test_a_full_disk_is_one_sentence(tmp_path, code):
    target = tmp_path / "a.txt"
    target.write_text("old")
    with pytest.raises(WriteFailed, match=r"^The disk is full: .*a\.txt was not written; free some space"):
        half_written(atomic_path(target), OSError(code, os.strerror(code)))
    assert target.read_text() == "old"
    assert names(tmp_path) == ["a.txt"]


def test_a_disk_that_fills_up_while_flushing(tmp_path, monkeypatch):
    def full(_descriptor):
        raise OSError(errno.ENOSPC, "No space left on device")

    (tmp_path / "a").write_text("old")
    monkeypatch.setattr(atomic.os, "fsync", full)
    with pytest.raises(WriteFailed), atomic_path(tmp_path / "a") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "a").read_text() == "old"
    assert names(tmp_path) == ["a"]


@pytest.mark.parametrize("name", sorted(WRITERS))
def test_every_writer_survives_ctrl_c_and_a_full_disk(tmp_path, monkeypatch, name):
    target = tmp_path / name
    WRITERS[name](target)
    old = target.read_bytes()

    def stop(_path):
        raise KeyboardInterrupt

    def full(_path):
        raise OSError(errno.ENOSPC, "No space left on device")

    for broken, expected in ((stop, KeyboardInterrupt), (full, WriteFailed)):
        with monkeypatch.context() as patch:
            patch.setattr(atomic, "_flush", broken)
            with pytest.raises(expected):
                WRITERS[name](target)
        assert target.read_bytes() == old
        assert names(tmp_path) == [name]


@pytest.mark.skipif(os.name == "nt" or not shutil.which("mount") or os.geteuid() != 0, reason="needs to mount a tmpfs")
def test_a_disk_that_is_really_full(tmp_path):
    small = tmp_path / "small"
    small.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(small)], check=False)
    if mounted.returncode:
        pytest.skip("mounting is not allowed here")
    try:
        (small / "filler").write_bytes(b"\0" * 40_000)
        for name in ("ct.nii.gz", "ct.nii", "ct.nrrd"):
            (small / name).write_text("old")
            with pytest.raises(WriteFailed, match="The disk is full"):
                write_volume(small / name, NOISE)
            assert (small / name).read_text() == "old"
        assert names(small) == ["ct.nii", "ct.nii.gz", "ct.nrrd", "filler"]
    finally:
        subprocess.run(["umount", str(small)], check=True)


def test_places_that_cannot_be_written(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("")
    with pytest.raises(BadInput, match="is a folder"), atomic_path(tmp_path / "folder"):
        pass
    with pytest.raises(BadInput, match="cannot be written"), atomic_path(tmp_path / "file" / "a"):
        pass
    with pytest.raises(BadInput, match="cannot be written"), atomic_path(tmp_path / ("n" * 250)):
        pass


def test_a_link_keeps_being_a_link(tmp_path):
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    with atomic_path(tmp_path / "link") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "new"


def test_a_folder_is_replaced_whole(tmp_path):
    target = tmp_path / "case"
    for content in ("first", "second"):
        with atomic_folder(target) as temporary:
            (temporary / "inner").mkdir()
            (temporary / "inner" / content).write_text(content)
    assert names(target / "inner") == ["second"]
    assert names(tmp_path) == ["case"]


@pytest.mark.parametrize("thrown", [KeyboardInterrupt, OSError(errno.ENOSPC, "full")])
def test_an_interruption_leaves_the_old_folder(tmp_path, thrown):
    target = tmp_path / "case"
    target.mkdir()
    (target / "a").write_text("old")
    with pytest.raises((KeyboardInterrupt, WriteFailed)):
        half_written(atomic_folder(target), thrown)
    assert (target / "a").read_text() == "old"
    assert names(tmp_path) == ["case"]


def test_an_interruption_between_the_two_renames_of_a_folder(tmp_path, monkeypatch):
    target = tmp_path / "case"
    target.mkdir()
    (target / "a").write_text("old")
    replace, calls = os.replace, []

    def second_fails(source, destination):
        calls.append(source)
        if len(calls) == 2:
            raise KeyboardInterrupt
        replace(source, destination)

    monkeypatch.setattr(os, "replace", second_fails)
    with pytest.raises(KeyboardInterrupt), atomic_folder(target) as temporary:
        (temporary / "a").write_text("new")
    assert (target / "a").read_text() == "old"
    assert names(tmp_path) == ["case"]

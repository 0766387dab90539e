"""Pages at true scale: what stands in the PDF, in points, against the mm that were asked for."""

import re
import zlib
from pathlib import Path

import numpy as np
import pytest

from glisson.core import BadInput
from glisson.io.true_scale_pdf import BAR_MM, Area, Sheet, write_true_scale_pdf

MM = 25.4 / 72.0
"""A point of PDF."""


def square(side: float, x: float = 0.0, y: float = 0.0) -> Area:
    half = 0.5 * side
    return Area(np.array([[-half, -half], [half, -half], [half, half], [-half, half]]) + [x, y], (1.0, 0.0, 0.0))


def boxes_mm(path: Path) -> list[tuple[float, float]]:
    """Sizes of the pages."""
    found = re.findall(rb"/MediaBox \[ *([\d.]+) ([\d.]+) ([\d.]+) ([\d.]+) *\]", path.read_bytes())
    return [((float(c) - float(a)) * MM, (float(d) - float(b)) * MM) for a, b, c, d in found]


def filled_mm(path: Path) -> list[np.ndarray]:
    """Corners of all filled polygons, mm from the page's lower left corner; nothing scales the page's content."""
    polygons = []
    for stream in re.findall(rb"stream\r?\n(.*?)\r?\nendstream", path.read_bytes(), re.DOTALL):
        try:
            text = zlib.decompress(stream).decode("latin-1")
        except zlib.error:
            continue
        if re.search(r"(^| )1 j", text) is None:
            continue  # a glyph, not a page
        text = re.sub(r"q\n[-\d. ]+ cm\nBT.*?ET\nQ", "", text, flags=re.DOTALL)  # words
        assert " cm" not in text
        for way in re.findall(r"((?:[-\d.]+ [-\d.]+ [ml]\s+)+)h\s+f", text):
            polygons.append(np.array(re.findall(r"([-\d.]+) ([-\d.]+) [ml]", way), dtype=float) * MM)
    return polygons


def test_lengths_on_paper_are_those_asked_for(tmp_path):
    path = tmp_path / "sheets.pdf"
    papers = write_true_scale_pdf(path, [Sheet("small", (square(150.0), square(12.5, 40.0, -30.0)))])
    assert papers == ("A4",)
    assert boxes_mm(path) == [pytest.approx((210.0, 297.0), abs=0.01)]
    paper, first, second, bar = filled_mm(path)
    assert np.ptp(paper, axis=0) == pytest.approx([210.0, 297.0], abs=0.01)
    assert np.ptp(first, axis=0) == pytest.approx([150.0, 150.0], abs=1e-3)
    assert np.ptp(second, axis=0) == pytest.approx([12.5, 12.5], abs=1e-3)
    assert second.mean(axis=0) - first.mean(axis=0) == pytest.approx([40.0, -30.0], abs=1e-3)
    assert np.ptp(bar[:, 0]) == pytest.approx(BAR_MM, abs=1e-3)


def test_a_large_sheet_goes_on_larger_paper_and_across(tmp_path):
    path = tmp_path / "sheets.pdf"
    tall, wide = square(240.0), Area([[-200.0, -50.0], [200.0, -50.0], [200.0, 50.0]])
    assert write_true_scale_pdf(path, [Sheet("tall", (tall,)), Sheet("wide", (wide,))]) == ("A3", "A3")
    assert boxes_mm(path) == [pytest.approx((297.0, 420.0), abs=0.01), pytest.approx((420.0, 297.0), abs=0.01)]


def test_the_same_sheets_are_the_same_file(tmp_path):
    for name in ("a.pdf", "b.pdf"):
        write_true_scale_pdf(tmp_path / name, [Sheet("small", (square(50.0),))])
    assert (tmp_path / "a.pdf").read_bytes() == (tmp_path / "b.pdf").read_bytes()


def test_what_does_not_fit_is_told(tmp_path):
    with pytest.raises(BadInput, match="does not fit on A3"):
        write_true_scale_pdf(tmp_path / "sheets.pdf", [Sheet("huge", (square(500.0),))])
    assert not (tmp_path / "sheets.pdf").exists()

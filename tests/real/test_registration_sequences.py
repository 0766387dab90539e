"""Forces on the public liver that a tool pulls (Mestdagh and Cotin 2022), whose truth is on another mesh."""

from pathlib import Path

import pytest

from glisson.framework.pipeline import Unheard
from glisson.studies.registration.sequences import measured, trials
from glisson.studies.registration.sequences_text import sequence_lines

pytestmark = pytest.mark.real


def test_the_first_frames_of_a_pulled_liver(shared_data: Path) -> None:
    """It moves by up to 35 mm under 1.8 to 1.9 N. Mestdagh and Cotin's own code is off by 6.3 % in the force."""
    folder = shared_data / "open" / "mestdagh-liver-sequences"
    row = measured(trials(quick=True)[0], folder, Unheard())
    assert (row["cases"], row["failed"], row["flagged"]) == (5, 0, 0)
    assert row["tre_mm"]["mean"] < 0.45
    assert row["force_percent"] < 8.0
    assert any("neohookean-s1" in line for line in sequence_lines([row]))

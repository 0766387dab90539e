"""Breaths, phases, residuals, gating, displacement and plateau against closed forms and exact truth."""

from dataclasses import replace

import numpy as np
import pytest

from glisson.core.camera import Camera
from glisson.core.errors import BadInput, StageFailed
from glisson.core.status import Status
from glisson.core.tracks import Tracks
from glisson.intraoperative.breathing.cycles import find_cycles
from glisson.intraoperative.breathing.displacement import Displacement, displacement_at, fresh_frames
from glisson.intraoperative.breathing.motion_model import fit_breathing
from glisson.intraoperative.breathing.plateau import find_plateau
from glisson.phantom.breathing.exposing import Shutter
from glisson.phantom.breathing.motion import Irregularity, draw_breaths
from glisson.phantom.breathing.tissue import draw_tissue
from glisson.phantom.breathing.view import BreathingVideo

CAMERA = Camera(960, 540, [640.0, 640.0], [482.0, 268.0], [-0.22, 0.06, 5e-4, -4e-4, 0.0])
MM_PER_PX = 0.14


def tracks_of(times, places, noise, seed=0, unit="px"):
    rng = np.random.default_rng(seed)
    seen = places + noise * rng.standard_normal(places.shape)
    spread = np.broadcast_to(max(noise, 1e-6) ** 2 * np.eye(2), (*places.shape, 2))
    return Tracks(times, seen, spread, np.zeros(places.shape[:2], dtype=np.int8), unit)


def breathing(seed, seconds=45.0, excursion=20.0, marks=6):
    rng = np.random.default_rng(seed)
    breaths = draw_breaths(60.0 / rng.uniform(9.0, 15.0), seconds, Irregularity(), rng)
    video = BreathingVideo(CAMERA, draw_tissue(excursion, rng, marks), breaths, int(25 * seconds), Shutter(25.0))
    return breaths, video.times_s, video.marks_px()


@pytest.mark.parametrize("seed", [101, 102, 103])
def test_phase_and_residual_of_irregular_breaths_with_drift_and_gaps(seed):
    breaths, times, truth = breathing(seed)
    tracks = tracks_of(times, truth, 0.05, seed)
    states = np.array(tracks.states)
    states[200:290, 1] = states[400:420, 2] = 2
    tracks = replace(tracks, states=states)
    cycles = find_cycles(tracks)
    inside = np.isfinite(cycles.phase)
    assert inside.mean() > 0.6
    off = (cycles.phase - breaths.phase(times) + 0.5) % 1.0 - 0.5
    assert np.abs(off[inside]).max() < 0.03
    assert cycles.rate_per_minute == pytest.approx(60.0 / np.diff(breaths.starts_s).mean(), rel=0.15)
    model = fit_breathing(tracks, cycles)
    left = MM_PER_PX * np.linalg.norm(model.drift(times) + model.breathing(times) - truth, axis=2)[inside]
    phase = (10.0 * (cycles.phase[inside] % 1.0)).astype(int)
    assert max(np.sqrt((left[phase == n] ** 2).mean()) for n in range(10)) < 0.5
    # The tissue moves by 20 mm in the middle of the patch.
    assert MM_PER_PX * np.mean(model.excursions()) == pytest.approx(20.0, rel=0.15)


def test_the_model_foretells_frames_that_it_has_not_seen():
    """A marker hidden in one part of the recording: its places there follow from the others' breathing."""
    _, times, truth = breathing(104, 60.0)
    tracks = tracks_of(times, truth, 0.05)
    states = np.array(tracks.states)
    states[700:1000, 3] = 2
    hidden = replace(tracks, states=states)
    cycles = find_cycles(hidden)
    model = fit_breathing(hidden, cycles)
    told = (model.drift(times) + model.breathing(times))[700:1000, 3]
    known = np.isfinite(told[:, 0])
    assert known.any()
    off = MM_PER_PX * np.linalg.norm(told - truth[700:1000, 3], axis=1)[known]
    assert np.sqrt((off**2).mean()) < 0.5


@pytest.mark.parametrize("marks", [1, 2, 5])
def test_gaps_of_few_markers(marks):
    """One of them is hidden at full inhalation in every breath; the others, where there are any, say where it is."""
    breaths, times, truth = breathing(107, 45.0, marks=marks)
    tracks = tracks_of(times, truth, 0.05)
    states = np.array(tracks.states)
    states[breaths.along(times) > 0.7, 0] = 2
    hidden = replace(tracks, states=states)
    cycles = find_cycles(hidden)
    inside = np.isfinite(cycles.phase)
    if marks > 1:
        off = (cycles.phase - breaths.phase(times) + 0.5) % 1.0 - 0.5
        assert np.abs(off[inside]).max() < 0.05
        model = fit_breathing(hidden, cycles)
        left = MM_PER_PX * np.linalg.norm(model.drift(times) + model.breathing(times) - truth, axis=2)[inside]
        assert np.sqrt((left**2).mean(axis=0)).max() < 0.5


def test_gated_frames_are_those_near_full_exhalation():
    breaths, times, truth = breathing(105)
    cycles = find_cycles(tracks_of(times, truth, 0.05))
    model = fit_breathing(tracks_of(times, truth, 0.05), cycles)
    gate = model.gate(times, 1.0 / MM_PER_PX)
    depth = breaths.along(times) - np.interp(times, breaths.starts_s, breaths.levels)
    assert 0.1 < gate.mean() < 0.5
    assert 20.0 * depth[gate].max() < 2.0
    assert not gate[~np.isfinite(cycles.phase)].any()
    assert model.gate(times, 1e6).sum() == np.isfinite(cycles.phase).sum()


def test_a_given_moment_of_exhalation_decides_what_cannot_be_told():
    """A sine stays as long at one end as at the other."""
    times = np.arange(0.0, 40.0, 0.04)
    places = np.zeros((len(times), 3, 2)) + 300.0
    places[:, :, 1] += 50.0 * np.cos(2.0 * np.pi * times / 4.0)[:, None]
    tracks = tracks_of(times, places, 0.05)
    assert "exchanged" in find_cycles(tracks).notes[0]
    for moment, first in ((8.0, 0.0), (10.0, 2.0)):
        cycles = find_cycles(tracks, moment)
        assert cycles.notes == ()
        apart = (cycles.exhalations_s - first + 2.0) % 4.0 - 2.0
        assert np.abs(apart).max() < 0.12
        assert cycles.rate_per_minute == pytest.approx(15.0, rel=0.01)


def test_what_does_not_breathe_is_told():
    times = np.arange(0.0, 20.0, 0.04)
    still = np.full((len(times), 4, 2), 200.0)
    with pytest.raises(StageFailed, match="repeats itself"):
        find_cycles(tracks_of(times, still, 0.05))
    _, moments, truth = breathing(106, 6.0)
    with pytest.raises(StageFailed, match=r"repeats itself|two whole breaths"):
        find_cycles(tracks_of(moments, truth, 0.05))
    lost = replace(tracks_of(times, still, 0.05), states=np.full((len(times), 4), 2))
    with pytest.raises(StageFailed, match="half of the frames"):
        find_cycles(lost)


def strokes(rate, frames_per_s, amplitude=1.5, exposure=0.0, seconds=4.0, marks=5, noise=0.03):
    """Markers on a straight way of that amplitude, averaged over an exposure in closed form."""
    times = np.arange(round(seconds * frames_per_s)) / frames_per_s
    places = np.full((len(times), marks, 2), 300.0)
    wave = amplitude * np.sinc(rate * exposure) * np.cos(2.0 * np.pi * rate * (times + 0.5 * exposure) + 0.4)
    places[:, :, 1] += wave[:, None] + 2.0 * times[:, None]
    places[:, :, 0] += 0.5 * wave[:, None]
    return tracks_of(times, places, noise)


TRUE = 2.0 * 1.5 * np.sqrt(1.25)


@pytest.mark.parametrize(
    ("rate", "frames_per_s", "exposure"), [(4.0, 25.0, 0.005), (10.0, 60.0, 0.016), (11.0, 25.0, 0.02)]
)
def test_displacement_is_twice_the_amplitude_whatever_the_exposure(rate, frames_per_s, exposure):
    found = displacement_at(strokes(rate, frames_per_s, exposure=exposure), rate, exposure)
    assert found.status is Status.CONVERGED
    assert found.value == pytest.approx(TRUE, abs=max(4.0 * found.sigma, 0.01))
    assert found.sigma < 0.02
    # The ventilator may be half a percent off what it says.
    off = displacement_at(strokes(1.005 * rate, frames_per_s, exposure=exposure), rate, exposure)
    assert off.value == pytest.approx(TRUE, rel=0.02)


def test_noise_alone_is_no_displacement():
    assert displacement_at(strokes(9.0, 60.0, amplitude=0.0), 9.0).value < 0.02


def test_what_frame_rate_or_shutter_cannot_resolve_is_flagged():
    slow = displacement_at(strokes(13.0, 25.0), 13.0)
    assert slow.status is Status.UNOBSERVABLE
    assert "25.0 pictures per second cannot resolve 13 Hz" in slow.reasons[0]
    long = displacement_at(strokes(12.0, 25.0, exposure=0.038), 12.0, 0.038)
    assert long.status is Status.UNOBSERVABLE
    assert "averages over 0.46 of a stroke" in long.reasons[0]
    few = strokes(1.0, 25.0)
    with pytest.raises(StageFailed, match=r"4\.0 strokes"):
        displacement_at(few, 1.0)
    with pytest.raises(BadInput, match="rate must be positive"):
        displacement_at(few, -1.0)


def test_a_rate_at_which_nothing_could_be_followed_is_flagged_too():
    tracks = strokes(9.0, 60.0)
    blurred = replace(tracks, states=np.where(np.arange(len(tracks.times_s))[:, None] < 150, 2, tracks.states))
    found = displacement_at(blurred, 9.0)
    assert found.status is Status.UNOBSERVABLE
    assert "half of the frames" in found.reasons[0]
    assert np.isnan(found.value)


def test_a_recorder_that_repeats_frames_does_not_make_the_camera_faster():
    camera = strokes(10.0, 30.0)
    doubled = Tracks(
        np.arange(2 * len(camera.times_s)) / 60.0, np.repeat(camera.places, 2, axis=0),
        np.repeat(camera.covariance, 2, axis=0), np.repeat(camera.states, 2, axis=0),
    )  # fmt: skip
    assert fresh_frames(doubled).mean() == pytest.approx(0.5)
    found = displacement_at(doubled, 10.0, 0.001)
    assert found.frames_per_s == pytest.approx(30.0, rel=0.01)
    assert found.value == pytest.approx(TRUE, rel=0.01)
    assert displacement_at(doubled, 16.0, 0.001).status is Status.UNOBSERVABLE


def sweep(at, floor=0.4, slope=0.6, rates=None, noise=0.01, seed=0):
    rates = np.arange(4.0, 14.01, 0.5) if rates is None else rates
    rng = np.random.default_rng(seed)
    values = floor + slope * np.maximum(at - rates, 0.0) + noise * rng.standard_normal(len(rates))
    return [
        Displacement(float(rate), float(value), 0.005, 60.0, Status.CONVERGED)
        for rate, value in zip(rates, values, strict=True)
    ]


@pytest.mark.parametrize("at", [6.3, 8.0, 10.8, 11.7])
def test_the_break_of_a_broken_line_is_found(at):
    plateau = find_plateau(sweep(at))
    assert plateau.status is Status.CONVERGED
    assert plateau.rate_hz == pytest.approx(at, abs=0.3)
    low, high = plateau.interval_hz
    assert low <= plateau.rate_hz <= high
    assert high - low < 1.0
    assert plateau.displacement == pytest.approx(0.4, abs=0.03)


def test_the_interval_holds_the_break_as_often_as_it_says():
    held = 0
    for seed in range(100):
        at = np.random.default_rng([seed, 7]).uniform(6.0, 12.0)
        plateau = find_plateau(sweep(at, noise=0.02, seed=seed))
        held += plateau.interval_hz is not None and plateau.interval_hz[0] <= at <= plateau.interval_hz[1]
    # Of 100 intervals of 90 % between 80 and 100 hold the truth in all but one of a thousand trials.
    assert held >= 80


def test_no_plateau_is_no_number():
    falling = find_plateau(sweep(20.0))
    assert falling.status is Status.UNOBSERVABLE
    assert falling.rate_hz is None
    assert "may still fall at 14 Hz" in falling.sentence
    flat = find_plateau(sweep(2.0))
    assert (flat.status, flat.rate_hz) == (Status.UNOBSERVABLE, None)
    blind = [replace(d, status=Status.UNOBSERVABLE) if d.rate_hz > 7.0 else d for d in sweep(10.0)]
    told = find_plateau(blind)
    assert told.status is Status.UNOBSERVABLE
    assert "14 rates that the recording cannot resolve are left out" in told.sentence

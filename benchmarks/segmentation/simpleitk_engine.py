"""Level sets of SimpleITK: `python simpleitk_engine.py threshold|geodesic PICTURE OUT`."""

import sys

import numpy as np
import SimpleITK as sitk
from adapter import Found, run
from problem import ITERATIONS, Problem

_SPREADS = 4.0
"""Half of the band of grey values, in spreads of those in the start …"""

_LEAST_HU = 16.0
""" … and at least."""


def threshold(problem: Problem) -> Found:
    """A level set that grows inside a band of grey values and shrinks outside of it."""
    level = float(np.median(problem.picture[problem.start]))
    half = max(_SPREADS * problem.contrast, _LEAST_HU)
    flow = sitk.ThresholdSegmentationLevelSetImageFilter()
    flow.SetLowerThreshold(level - half)
    flow.SetUpperThreshold(level + half)
    flow.SetPropagationScaling(1.0)
    flow.SetCurvatureScaling(1.0)
    flow.SetMaximumRMSError(0.005)
    flow.SetNumberOfIterations(ITERATIONS)
    flow.ReverseExpansionDirectionOn()
    grown = flow.Execute(_distance(problem, inside_positive=True), _image(problem, problem.picture))
    return Found(sitk.GetArrayFromImage(grown) > 0.0, flow.GetElapsedIterations())


def geodesic(problem: Problem) -> Found:
    """A geodesic active contour that is pushed outward and held by edges."""
    image = _image(problem, problem.picture)
    slope = sitk.GradientMagnitudeRecursiveGaussian(image, 1.5)
    inside = float(np.median(sitk.GetArrayFromImage(slope)[problem.start]))
    edges = sitk.Sigmoid(slope, -2.0, inside + 8.0, 1.0, 0.0)
    flow = sitk.GeodesicActiveContourLevelSetImageFilter()
    flow.SetPropagationScaling(1.0)
    flow.SetCurvatureScaling(0.5)
    flow.SetAdvectionScaling(1.0)
    flow.SetMaximumRMSError(0.005)
    flow.SetNumberOfIterations(ITERATIONS)
    grown = flow.Execute(_distance(problem, inside_positive=False), sitk.Cast(edges, sitk.sitkFloat32))
    return Found(sitk.GetArrayFromImage(grown) < 0.0, flow.GetElapsedIterations())


def _image(problem: Problem, values: np.ndarray) -> sitk.Image:
    image = sitk.GetImageFromArray(values)
    image.SetSpacing(problem.spacing_mm[::-1].tolist())
    return image


def _distance(problem: Problem, inside_positive: bool) -> sitk.Image:
    start = _image(problem, problem.start.astype(np.uint8))
    distance = sitk.SignedMaurerDistanceMap(
        start, insideIsPositive=inside_positive, squaredDistance=False, useImageSpacing=True
    )
    return sitk.Cast(distance, sitk.sitkFloat32)


METHODS = {"threshold": threshold, "geodesic": geodesic}

if __name__ == "__main__":
    run(sitk.Version_VersionString(), METHODS[sys.argv[1]])

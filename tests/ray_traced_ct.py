"""A CT slice with metal, from rays in closed form: ellipses, five photon energies, counted photons.

Attenuations are rounded from the tables of NIST (Hubbell and Seltzer 2004); beam hardening in water is corrected as
scanners do. So what metal does to the picture is none of Glisson's own making.
"""

import numpy as np
from numpy.typing import NDArray
from skimage.transform import iradon

_WEIGHTS = np.array([0.15, 0.28, 0.27, 0.20, 0.10])  # of 40, 55, 70, 85 and 100 keV
_ATTENUATION = {  # 1/cm at these energies
    "water": np.array([0.268, 0.215, 0.193, 0.180, 0.171]),
    "fat": np.array([0.247, 0.198, 0.178, 0.166, 0.157]),
    "bone": np.array([1.28, 0.70, 0.50, 0.41, 0.36]),
    "metal": np.array([12.0, 5.5, 3.0, 2.0, 1.5]),
}
_PHOTONS = 4e5
_ANGLES = 720
_SIZE = 256
PIXEL_MM = 1.4

Ellipse = tuple[float, float, float, float, float, str, float]  # centre, half axes (mm), turn, material, density


def abdomen_with_metal(seed: int, with_metal: bool) -> NDArray[np.float32]:
    """HU (256, 256) of a fat ring, soft tissue, a liver, ribs and spine, with one to three pieces of metal or none."""
    random = np.random.default_rng(seed)
    ellipses: list[Ellipse] = [
        (0.0, 0.0, 150.0, 105.0, 0.0, "fat", 1.0), (0.0, 0.0, 135.0, 92.0, 0.0, "fat", -1.0),
        (0.0, 0.0, 135.0, 92.0, 0.0, "water", 1.04),
        (-55.0 + random.normal(0.0, 5.0), -5.0 + random.normal(0.0, 5.0), 55.0, 45.0, random.uniform(), "water", 0.06),
    ]  # fmt: skip
    for x, y, a, b, turn, density in (
        (0, 60, 14, 14, 0.0, 1.0),
        (-105, 20, 6, 12, -0.3, 0.7),
        (105, 20, 6, 12, 0.3, 0.7),
    ):
        ellipses += [(x, y, a, b, turn, "water", -1.04), (x, y, a, b, turn, "bone", density)]
    ellipses.append((60.0, -40.0, 25.0, 12.0, 0.2, "water", -1.04))  # gas
    for _ in range(int(random.integers(1, 4))):
        x, y, a, b = random.uniform((-90.0, -45.0, 1.5, 1.5), (30.0, 35.0, 4.0, 4.0)).tolist()
        if with_metal:
            ellipses += [(x, y, a, b, 0.0, "water", -1.04), (x, y, a, b, 0.0, "metal", 1.0)]
    return _scanned(ellipses, np.random.default_rng([seed, int(with_metal)]))


def _scanned(ellipses: list[Ellipse], random: np.random.Generator) -> NDArray[np.float32]:
    theta = np.linspace(0.0, np.pi, _ANGLES, endpoint=False)
    width = int(np.ceil(np.sqrt(2.0) * _SIZE))
    places = (np.arange(width) - width // 2) * PIXEL_MM
    paths = dict.fromkeys(_ATTENUATION, np.zeros((width, _ANGLES)))
    for *shape, material, density in ellipses:
        paths[material] = paths[material] + density * _chords(*shape, theta, places)
    passed = np.zeros((width, _ANGLES))
    for n, weight in enumerate(_WEIGHTS):
        passed += weight * np.exp(-sum(_ATTENUATION[m][n] * path / 10.0 for m, path in paths.items()))
    rays = -np.log(np.maximum(random.poisson(passed * _PHOTONS), 1) / _PHOTONS)
    water_mm = np.linspace(0.0, 1500.0, 1000)
    through_water = -np.log(_WEIGHTS @ np.exp(-np.outer(_ATTENUATION["water"], water_mm) / 10.0))
    corrected = np.interp(rays, through_water, water_mm) / PIXEL_MM
    picture = iradon(corrected, np.rad2deg(theta), output_size=width, circle=True, filter_name="hann")
    first = (width - _SIZE) // 2
    hu = 1000.0 * (picture[first : first + _SIZE, first : first + _SIZE] - 1.0)
    return np.clip(hu, -1024.0, 3071.0).astype(np.float32)


def _chords(
    x: float, y: float, a: float, b: float, turn: float, theta: NDArray[np.float64], places: NDArray[np.float64]
) -> NDArray[np.float64]:
    """How far each ray (place, angle) runs through an ellipse, mm."""
    width = a**2 * np.cos(theta - turn) ** 2 + b**2 * np.sin(theta - turn) ** 2
    offset = places[:, None] - (x * np.cos(theta) + y * np.sin(theta))
    chords: NDArray[np.float64] = 2.0 * a * b * np.sqrt(np.maximum(width - offset**2, 0.0)) / width
    return chords

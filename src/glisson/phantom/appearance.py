"""How the tissues of a phantom look in its scan: HU by contrast phase, or signal of an MR sequence.

HU are typical of textbooks' and radiologists' figures for 120 kV; a drawn appearance varies them, so that no
segmenter can know them. The liver is brighter than its vessels in MR (hepatobiliary phase, T1) and darker in CT.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

_PORTAL = {
    "air": -1000.0, "lung": -830.0, "gas": -850.0, "stomach gas": -820.0, "skin fat": -95.0, "fat": -90.0,
    "muscle": 58.0, "diaphragm": 55.0, "back muscle": 58.0, "psoas": 60.0, "crura": 58.0,
    "rib": 480.0, "rib marrow": 240.0, "bone": 420.0, "marrow": 190.0, "arch": 420.0, "disc": 90.0, "canal": 25.0,
    "heart": 118.0, "stomach wall": 88.0, "stomach": 28.0, "colon": 45.0, "duodenum": 62.0,
    "aorta": 185.0, "spleen": 122.0, "kidney": 195.0, "renal pelvis": 20.0,
    "cava": 145.0, "liver": 110.0, "portal": 172.0, "hepatic": 165.0, "tumour": 70.0,
    "duct": 10.0, "gallbladder": 10.0, "wire": 2600.0, "metal": 3000.0,
}  # fmt: skip
_LATE = _PORTAL | {
    "heart": 122.0, "stomach wall": 80.0, "aorta": 128.0, "spleen": 104.0, "kidney": 150.0, "renal pelvis": 260.0,
    "cava": 126.0, "liver": 96.0, "portal": 128.0, "hepatic": 128.0, "tumour": 66.0,
}  # fmt: skip
_FATTY = _PORTAL | {"liver": 78.0, "portal": 165.0, "hepatic": 158.0, "tumour": 52.0}
_CT_PHASES = {"portal": _PORTAL, "late": _LATE, "fatty": _FATTY}

_MR_T1 = {
    "air": 0.0, "lung": 15.0, "gas": 0.0, "stomach gas": 0.0, "skin fat": 130.0, "fat": 120.0,
    "muscle": 190.0, "diaphragm": 185.0, "back muscle": 190.0, "psoas": 190.0, "crura": 190.0,
    "rib": 40.0, "rib marrow": 150.0, "bone": 50.0, "marrow": 170.0, "arch": 50.0, "disc": 140.0, "canal": 70.0,
    "heart": 260.0, "stomach wall": 200.0, "stomach": 80.0, "colon": 150.0, "duodenum": 190.0,
    "aorta": 240.0, "spleen": 230.0, "kidney": 330.0, "renal pelvis": 90.0,
    "cava": 235.0, "liver": 420.0, "portal": 250.0, "hepatic": 245.0, "tumour": 210.0,
    "duct": 120.0, "gallbladder": 110.0, "wire": 0.0, "metal": 0.0,
}  # fmt: skip


@dataclass(frozen=True)
class Appearance:
    """Grey value of each tissue, and what disturbs the picture.

    `noise` and `texture` (uneven enhancement of the liver, over some 15 mm) are standard deviations in grey
    values, `clips` the number of metal clips in and about the liver, `metal_streaks` and `gas_streaks` the standard
    deviation of streaks near their source, and `bias` that of the logarithm of an MR coil's sensitivity.
    """

    name: str
    modality: str
    values: Mapping[str, float]
    noise: float
    texture: float = 2.5
    clips: int = 0
    metal_streaks: float = 0.0
    gas_streaks: float = 0.0
    bias: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", MappingProxyType(dict(self.values)))


PORTAL_PHASE = Appearance("portal", "CT", _PORTAL, noise=11.0)
"""The portal-venous CT of a phantom where nothing else is asked for."""


def draw_ct(seed: int) -> Appearance:
    """A CT of some phase, HU varied by a few, with noise of 7 to 18 HU, and half of them with clips and streaks."""
    random = np.random.default_rng([seed, 11])
    name = ("portal", "portal", "late", "fatty")[int(random.integers(4))]
    shift, spread = random.normal(0.0, 6.0), 3.0
    soft = {
        tissue: value + shift + random.normal(0.0, spread) if 0.0 < value < 400.0 else value
        for tissue, value in _CT_PHASES[name].items()
    }
    disturbed = random.random() < 0.5
    return Appearance(
        name,
        "CT",
        soft,
        noise=float(random.uniform(7.0, 18.0)),
        texture=float(random.uniform(1.5, 4.0)),
        clips=int(random.integers(1, 4)) if disturbed else 0,
        metal_streaks=float(random.uniform(15.0, 40.0)) if disturbed else 0.0,
        gas_streaks=float(random.uniform(5.0, 15.0)) if random.random() < 0.5 else 0.0,
    )


def draw_mr(seed: int) -> Appearance:
    """A T1-weighted MR in the hepatobiliary phase: bright liver, dark vessels, uneven sensitivity."""
    random = np.random.default_rng([seed, 12])
    scale = float(random.uniform(0.5, 3.0))
    values = {tissue: scale * value * float(random.uniform(0.93, 1.07)) for tissue, value in _MR_T1.items()}
    return Appearance(
        "T1",
        "MR",
        values,
        noise=scale * float(random.uniform(10.0, 22.0)),
        texture=scale * float(random.uniform(4.0, 9.0)),
        bias=float(random.uniform(0.1, 0.25)),
    )

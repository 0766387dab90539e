"""A case from Python: the same manoeuvre with a soft and a stiff liver, and where the tumour is then.

Run it on a case of your own with: python examples/two_materials.py CASE
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from glisson.framework.case import open_case
from glisson.framework.stages import PIPELINE


def main(folder: str | Path) -> dict[float, float]:
    """Way of the target in mm, by the liver's Young's modulus in kPa; the case keeps the last one."""
    case = open_case(folder)
    settings = case.settings()
    ways = {}
    for young_modulus_kpa in (6.0, 12.0):
        liver = replace(settings.materials["liver"], young_modulus_kpa=young_modulus_kpa)
        changed = replace(settings, materials={**settings.materials, "liver": liver})
        tumour = PIPELINE.run(case, "navigate", changed).facts["navigate"]["tumour"]
        ways[young_modulus_kpa] = float(np.linalg.norm(np.subtract(tumour["after_mm"], tumour["before_mm"])))
        print(f"{young_modulus_kpa:g} kPa: the tumour moves by {ways[young_modulus_kpa]:.2f} mm")
    return ways


if __name__ == "__main__":
    main(sys.argv[1])

"""The README's picture, from a demo that was run: python scripts/make_readme_picture.py demo

The liver as scanned and the liver lifted, with displacement colours, as in the demo's report.
"""

import base64
import sys
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.image import imread, imsave

from glisson.framework.case import open_case
from glisson.framework.stages import report_inputs
from glisson.navigation.report_figures import report_figures

TARGET = Path(__file__).resolve().parent.parent / "docs" / "images" / "lever-lift.png"


def main(folder: str) -> None:
    """Write `docs/images/lever-lift.png` from the results in a case folder."""
    case = open_case(folder)
    inputs = report_inputs(case, case.settings())
    figures = report_figures(inputs, None)
    before, after = figures.manoeuvre[0], figures.manoeuvre[len(inputs.deformation.stages)]
    images = [imread(BytesIO(base64.b64decode(picture.source.partition(",")[2]))) for picture in (before, after)]
    TARGET.parent.mkdir(parents=True, exist_ok=True)
    both = np.hstack([image[:, :, :3] for image in images])
    height, width = both.shape[0] // 2, both.shape[1] // 2
    halved = both[: 2 * height, : 2 * width].reshape(height, 2, width, 2, 3).mean(axis=(1, 3))
    imsave(TARGET, halved)
    print(f"{TARGET}: {before.caption} {after.caption}")


if __name__ == "__main__":
    main(sys.argv[1])

"""The landmarks from which Couinaud's segments are told apart, by name.

The veins and branches are those of Couinaud (1957) and Bismuth (1982); P2 to P8 is how surgeons call the portal
branches of the segments. The dissertation (section 2.3.1) asks for landmarks on the portal vein and its branches.
"""

from collections.abc import Sequence
from difflib import get_close_matches

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.landmarks import Landmarks

BIFURCATION, CONFLUENCE = "portal bifurcation", "hepatic confluence"
UMBILICAL, RIGHT_PORTAL, LEFT_PORTAL = "umbilical portion", "right portal plane", "left portal plane"
RIGHT_VEIN, MIDDLE_VEIN, LEFT_VEIN = "RHV", "MHV", "LHV"
RIGHT_FISSURE, GALLBLADDER_FOSSA, UMBILICAL_FISSURE = "right fissure", "gallbladder fossa", "umbilical fissure"
CAVA, CAUDATE_LEFT, CAUDATE_RIGHT, CAUDATE_FRONT = "IVC", "caudate left", "caudate right", "caudate front"
CAUDATE_TOP, CAUDATE_BOTTOM = "caudate top", "caudate bottom"
BRANCHES = {f"P{number}": number for number in range(2, 9)}
"""Landmark on a segment's portal branch → the segment."""

PLACES = {
    BIFURCATION: "where the portal vein divides into right and left",
    CONFLUENCE: "where the hepatic veins meet the vena cava",
    RIGHT_VEIN: "the right hepatic vein, near its far end",
    MIDDLE_VEIN: "the middle hepatic vein, near its far end",
    LEFT_VEIN: "the left hepatic vein, near its far end",
    RIGHT_FISSURE: "on the surface, between the segments 5, 8 and 6, 7, far from the right hepatic vein",
    GALLBLADDER_FOSSA: "between the segments 5 and 4, at the gallbladder or the surface, far from the middle vein",
    UMBILICAL_FISSURE: "between the segments 4 and 2, 3, at the falciform ligament or fissure, far from the left vein",
    RIGHT_PORTAL: "at the height of the right portal vein, far right between the segments 7, 8 and 5, 6",
    UMBILICAL: "the left portal vein where it turns forward into the umbilical fissure",
    LEFT_PORTAL: "at the height of the left portal vein, far left between the segments 2 and 3",
    CAVA: "the middle of the vena cava at the caudate lobe",
    CAUDATE_LEFT: "the leftmost point of the caudate lobe",
    CAUDATE_RIGHT: "the rightmost point of the caudate lobe",
    CAUDATE_FRONT: "the foremost point of the caudate lobe",
    CAUDATE_TOP: "the uppermost point of the caudate lobe; may be left out",
    CAUDATE_BOTTOM: "the lowest point of the caudate lobe; may be left out",
    **{name: f"the portal branch of segment {number}; may be repeated" for name, number in BRANCHES.items()},
}
"""Name of each landmark and where it lies."""


def landmarks_from_points(labels: Sequence[str], points_mm: FloatArray, where: str) -> Landmarks:
    """Landmarks from points (n, 3) in LPS mm with a label each; `where` they are from stands in sentences.

    Raises:
        BadInput: a label is no landmark's name.
    """
    for label in labels:
        if label not in PLACES:
            near = get_close_matches(label, PLACES, n=1)
            hint = f" (perhaps {near[0]!r})" if near else ""
            raise BadInput(f"{where}: there is no landmark {label!r}{hint}; known are {', '.join(PLACES)}.")
    named = {name: [n for n, label in enumerate(labels) if label == name] for name in PLACES}
    return Landmarks({name: points_mm[numbers] for name, numbers in named.items() if numbers})

"""What can be in a picture: triangle meshes with a colour, an opacity and, if wanted, values to colour by."""

from collections.abc import Callable
from dataclasses import dataclass

from glisson.core.arrays import FloatArray, IntArray

Palette = Callable[[FloatArray], FloatArray]
"""Colours (n, 3) in 0 to 1 (sRGB) of values (n,)."""


@dataclass(frozen=True, eq=False)
class Body:
    """A triangle mesh to be drawn.

    `colour` is sRGB in 0 to 1. With `values` (one for each vertex) and a `palette` the colour is looked up
    in every pixel anew, so that steps of the palette stay sharp. Below an `opacity` of 1 what lies behind
    shows through, less so where the surface is seen at a grazing angle. `smooth` bodies have normals
    averaged over the triangles of a vertex; others show their facets. `inner` bodies lie within another
    one, which does not darken them. `ink` draws the outline.
    """

    vertices: FloatArray
    triangles: IntArray
    colour: tuple[float, float, float] = (0.8, 0.8, 0.8)
    opacity: float = 1.0
    smooth: bool = True
    gloss: float = 0.0
    values: FloatArray | None = None
    palette: Palette | None = None
    inner: bool = False
    ink: bool = True

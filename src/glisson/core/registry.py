"""Finds techniques by entry point, so that a lab adds its own without touching this package.

It lives in `core` because `mechanics` looks up material laws and must not import `framework`.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, is_dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from glisson.core.errors import BadInput
from glisson.core.parameters import build_parameters
from glisson.core.protocols import (
    InstrumentRecogniser,
    Localiser,
    MarkerTracker,
    MaterialLaw,
    Mesher,
    Registration,
    SegmentDivider,
    Segmenter,
    Solver,
    StructureSegmenter,
    SurfaceExtractor,
    SurfaceReconstructor,
    VesselSegmenter,
)

KINDS: dict[str, tuple[str, type[Any]]] = {
    "segmenter": ("glisson.segmenters", Segmenter),
    "vessel-segmenter": ("glisson.vessel_segmenters", VesselSegmenter),
    "structure-segmenter": ("glisson.structure_segmenters", StructureSegmenter),
    "segment-divider": ("glisson.segment_dividers", SegmentDivider),
    "surface-extractor": ("glisson.surface_extractors", SurfaceExtractor),
    "mesher": ("glisson.meshers", Mesher),
    "material": ("glisson.materials", MaterialLaw),
    "solver": ("glisson.solvers", Solver),
    "registration": ("glisson.registrations", Registration),
    "surface-reconstructor": ("glisson.surface_reconstructors", SurfaceReconstructor),
    "localiser": ("glisson.localisers", Localiser),
    "instrument-recogniser": ("glisson.instrument_recognisers", InstrumentRecogniser),
    "marker-tracker": ("glisson.marker_trackers", MarkerTracker),
}
"""Kind of technique → entry-point group and protocol."""


@dataclass(frozen=True)
class Listing:
    """A technique as `glisson techniques` shows it; `broken` is why it could not be loaded."""

    kind: str
    name: str
    package: str
    summary: str
    missing: tuple[str, ...]
    broken: str | None = None

    @property
    def is_available(self) -> bool:
        """Whether it can be used now."""
        return not self.missing and self.broken is None


def technique_class(kind: str, name: str) -> Any:
    """The class of a technique, checked to be usable.

    Raises:
        BadInput: unknown kind or name, two packages offering the same name, a package that does not
            load, or dependencies that are missing (the sentence says what to install).
    """
    point = _point(kind, name)
    try:
        loaded, missing = _loaded(kind, point)
    except Exception as error:  # a plug-in may fail in any way while it is imported
        raise BadInput(f"The {kind} technique {name!r} of {_package(point)} does not load: {error}.") from error
    if missing:
        raise BadInput(f"The {kind} technique {name!r} needs {', '.join(missing)}; install them first.")
    return loaded


def technique_package(kind: str, name: str) -> str:
    """The distribution that offers a technique.

    Raises:
        BadInput: there is no such technique.
    """
    return _package(_point(kind, name))


def make_technique(kind: str, name: str, values: Mapping[str, Any], where: str) -> Any:
    """A technique with parameters built from `values` (a TOML table or CLI options).

    Raises:
        BadInput: as `technique_class`, or a parameter is unknown or out of range.
    """
    made = technique_class(kind, name)
    return made(build_parameters(made.Parameters, values, where))


def list_techniques(kinds: Iterable[str] = KINDS) -> tuple[Listing, ...]:
    """Every technique of some kinds (all by default), the broken ones with the reason."""
    return tuple(_listing(kind, point) for kind in kinds for point in sorted(_points(kind), key=lambda p: p.name))


def _listing(kind: str, point: EntryPoint) -> Listing:
    try:
        loaded, missing = _loaded(kind, point)
        return Listing(kind, point.name, _package(point), loaded.summary, missing)
    except Exception as error:  # a plug-in may fail in any way while it is imported
        return Listing(kind, point.name, _package(point), "", (), f"{type(error).__name__}: {error}")


def _loaded(kind: str, point: EntryPoint) -> tuple[Any, tuple[str, ...]]:
    """The class behind an entry point, checked to be a technique, and what it misses."""
    loaded = point.load()
    if not is_dataclass(getattr(loaded, "Parameters", None)):
        raise TypeError("it has no dataclass Parameters, see glisson.core.protocols.Technique")
    if not isinstance(getattr(loaded, "summary", None), str) or getattr(loaded, "name", None) != point.name:
        raise TypeError(f"it needs a summary and the name {point.name!r} under which it is registered")
    _, protocol = KINDS[kind]
    methods = [name for name, value in vars(protocol).items() if callable(value) and not name.startswith("_")]
    lacking = [name for name in methods if not callable(getattr(loaded, name, None))]
    if lacking:
        raise TypeError(f"it lacks {', '.join(lacking)}, see glisson.core.protocols.{protocol.__name__}")
    return loaded, tuple(loaded.missing_dependencies())


def _point(kind: str, name: str) -> EntryPoint:
    found = [point for point in _points(kind) if point.name == name]
    if not found:
        known = sorted({point.name for point in _points(kind)})
        raise BadInput(f"There is no {kind} technique {name!r}; known are {known}.")
    if len(found) > 1:
        packages = sorted(_package(point) for point in found)
        raise BadInput(f"The {kind} technique {name!r} is offered by {packages}; uninstall all but one.")
    return found[0]


def _points(kind: str) -> tuple[EntryPoint, ...]:
    if kind not in KINDS:
        raise BadInput(f"There is no kind of technique {kind!r}; known are {sorted(KINDS)}.")
    group, _ = KINDS[kind]
    return tuple(entry_points(group=group))


def _package(point: EntryPoint) -> str:
    return point.dist.name if point.dist is not None else "an unknown package"

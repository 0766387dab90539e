"""What makes a case's scan and mask less useful than others, in sentences."""

from glisson.framework.case import ARTEFACTS, ORGAN, SCAN, Case
from glisson.io.images import read_labels, read_volume
from glisson.io.records import read_record
from glisson.preoperative.artefacts.metal import metal_warnings
from glisson.preoperative.imaging.scan_checks import organ_warnings, scan_warnings
from glisson.preoperative.model.regions import ORGAN as LIVER

ARTEFACTS_SCHEMA = 1
"""Version of the layout of `images/artefacts.json`."""


def case_warnings(case: Case) -> tuple[str, ...]:
    """Sentences on the scan, and on the liver where it has a mask.

    Raises:
        BadInput: a file of the case is damaged.
    """
    volume = read_volume(case.path(SCAN))
    on_metal = _on_artefacts(case) if case.has(ARTEFACTS) else metal_warnings(volume)
    return (
        scan_warnings(volume)
        + on_metal
        + (organ_warnings(read_labels(case.path(ORGAN)).mask(LIVER)) if case.has(ORGAN) else ())
    )


def _on_artefacts(case: Case) -> tuple[str, ...]:
    """What was said of the artefacts when the scan was cleaned."""
    with read_record(case.path(ARTEFACTS), "record of artefacts", ARTEFACTS_SCHEMA) as record:
        return record.texts("sentences")

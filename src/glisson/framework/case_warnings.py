"""What makes a case's scan and mask less useful than others, in sentences."""

from glisson.framework.case import ORGAN, SCAN, Case
from glisson.io.images import read_labels, read_volume
from glisson.preoperative.imaging.scan_checks import organ_warnings, scan_warnings
from glisson.preoperative.model.regions import ORGAN as LIVER


def case_warnings(case: Case) -> tuple[str, ...]:
    """Sentences on the scan, and on the liver where it has a mask.

    Raises:
        BadInput: a file of the case is damaged.
    """
    on_scan = scan_warnings(read_volume(case.path(SCAN)))
    return on_scan + (organ_warnings(read_labels(case.path(ORGAN)).mask(LIVER)) if case.has(ORGAN) else ())

"""The report: one self-contained HTML file with headline figures, pictures, tables and provenance."""

from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from glisson.core.deformation import Deformation
from glisson.navigation.report_figures import report_figures
from glisson.navigation.report_inputs import ReportInputs
from glisson.navigation.report_tables import FILTERS, headlines, plane_rows, tumour_rows, warnings
from glisson.navigation.survey import Survey, read_plan, survey

__all__ = ["ReportInputs", "write_report"]


def write_report(path: Path, inputs: ReportInputs) -> None:
    """Write the report as one HTML file (UTF-8) that needs nothing else, not even a network.

    Raises:
        BadInput: the plan does not fit the model.
        OSError: the file cannot be written.
    """
    found = _surveyed(inputs.deformation, inputs) if inputs.deformation.stages else None
    true = _surveyed(inputs.truth, inputs) if inputs.truth is not None and inputs.truth.status.is_good else None
    environment = Environment(
        loader=PackageLoader("glisson.navigation"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(FILTERS)
    page = environment.get_template("report.html.jinja").render(
        inputs=inputs,
        guidance=inputs.guidance,
        deformation=inputs.deformation,
        warnings=warnings(inputs.deformation, inputs.guidance),
        headlines=headlines(inputs.guidance),
        tumours=tumour_rows(inputs.guidance, true),
        planes=plane_rows(inputs.guidance, found, true),
        figures=report_figures(inputs, true),
    )
    path.write_text(page, encoding="utf-8")


def _surveyed(deformation: Deformation, inputs: ReportInputs) -> Survey:
    structures = inputs.model.structures
    return survey(deformation, structures, inputs.plan, read_plan(structures, inputs.plan))

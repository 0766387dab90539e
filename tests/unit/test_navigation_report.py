from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from blocks import bent, block, rotation, sphere

from glisson.core import (
    Board,
    ContactLaw,
    ContactReport,
    Curve,
    Deformation,
    Event,
    Grid,
    LabelMap,
    Lever,
    LeverDrive,
    LoadStep,
    Material,
    Model,
    Scenario,
    Stage,
    StageResult,
    Status,
    Structures,
    Tumour,
    VesselTree,
    Volume,
)
from glisson.navigation.guidance import navigate
from glisson.navigation.plan import Plan
from glisson.navigation.report import ReportInputs, write_report
from glisson.navigation.report_tables import number, point, shortened


class Page(HTMLParser):
    """Collects what the tests look at."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.images: list[dict] = []
        self.tags: list[str] = []
        self.words = ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        self.tags.append(tag)
        self.addresses += [attributes[key] for key in ("src", "href", "action", "data", "srcset") if key in attributes]
        if tag == "img":
            self.images.append(attributes)

    def handle_data(self, data):
        self.words += data


def scenario() -> Scenario:
    lever = Lever.lifting("lever", [20.0, 40.0, 10.0], np.array([1.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0]))
    stage = Stage("lift", ContactLaw(), (LeverDrive("lever", angle_deg=15.0),))
    return Scenario((Board("board", [0.0, 40.0, 0.0], [0.0, -1.0, 0.0]), lever), (stage,), surgery_gravity=[0, 1, 0])


def model(**changes) -> Model:
    parts = {
        "tumours": (Tumour("tumour1", sphere([70.0, 20.0, 10.0], 6.0)),),
        "trees": (VesselTree("portal", [[0, 10, 10], [90, 10, 10]], [2.0, 1.0], [[0, 1]]),),
        "duct": Curve([[0, 20, 10], [90, 20, 10]]),
        "wire_length_mm": 85.0,
    }
    mesh = block((10, 4, 2), (100.0, 40.0, 20.0)).as_quadratic()
    structures = Structures(**{**parts, **changes})
    return Model(mesh, {0: Material("neo-hookean", 7.0, 0.45)}, {0: "liver"}, {}, structures)


def deformation(of: Model, status=Status.CONVERGED, radius=90.0) -> Deformation:
    contact = ContactReport("lever", (0.1, -2.0, 0.0), 420.0, 3.0, 0.02, 0.5, 1.5, angle_deg=15.0, hinge_moment_nm=0.1)
    stage = StageResult("lift", bent(of.mesh.nodes, radius) - of.mesh.nodes, status, (contact,))
    record = tuple(LoadStep("lift", n / 3, 5 + n, 10.0**-n * 1e-6, 100.0 * n, status) for n in (1, 2, 3))
    return Deformation(of.mesh, (stage,), status, status.sentence, record, (Event("lost_contact", "lever", 12.0),))


def scan() -> tuple[Volume, LabelMap, LabelMap]:
    """A turned, coarse CT of the block with a tumour."""
    grid = Grid((60, 30, 20), [2.0, 2.0, 2.0], [-10.0, 52.0, -8.0], rotation([1, 0, 0], np.pi) @ np.diag([1, 1, -1]))
    places = grid.points_from_indices(np.stack(np.indices(grid.shape), axis=-1).reshape(-1, 3)).reshape(*grid.shape, 3)
    organ = np.all((places > 0.0) & (places < [100.0, 40.0, 20.0]), axis=-1).astype(np.uint8)
    tumour = (np.linalg.norm(places - [70.0, 20.0, 10.0], axis=-1) < 6.0).astype(np.uint8)
    voxels = (-80.0 + 180.0 * organ - 60.0 * tumour).astype(np.int16)
    return Volume(voxels, grid), LabelMap(organ, grid, {1: "liver"}), LabelMap(tumour, grid, {1: "tumour1"})


def write(tmp_path: Path, inputs: ReportInputs) -> tuple[str, Page]:
    path = tmp_path / "report.html"
    write_report(path, inputs)
    text = path.read_text(encoding="utf-8")
    return text, Page(text)


def test_the_full_report_stands_alone(tmp_path):
    body = model()
    found, truth = deformation(body), deformation(body, radius=100.0)
    volume, organ, tumours = scan()
    provenance = {
        "simulate": {"settings": {"steps": 8, "name": "<b>bold</b>"}, "inputs": {"mesh/": "sha256:" + "ab" * 32}}
    }
    told = navigate(body, found, Plan(), truth)
    inputs = ReportInputs(
        "A lift <script>alert(1)</script>",
        body,
        scenario(),
        found,
        told,
        Plan(),
        volume,
        organ,
        tumours,
        None,
        truth,
        provenance,
        {"mesh": 3.2, "simulate": 0.0},
    )
    text, page = write(tmp_path, inputs)
    assert page.addresses
    assert all(address.startswith("data:image/png;base64,") for address in page.addresses)
    for wanted in ("http:", "https:", "@import", "url("):
        assert wanted not in text
    assert not {"script", "link", "iframe", "object"} & set(page.tags)
    # Before, stage, truth; three planes; cut; slices; convergence.
    assert len(page.images) == 9
    assert all(len(image["alt"]) > 20 for image in page.images)
    assert "Research software, not for clinical use" in page.words
    assert text.index("Research software") < text.index("<h1>")
    assert "Lost contact with lever at 12°." in page.words
    assert f"{told.tumours[0].error_mm:.1f} mm from the truth" in page.words
    assert f"{100 * told.volume.removed_before:.1f} → {100 * told.volume.removed_after:.1f} %" in page.words
    assert "abababababab…" in page.words
    assert "<b>bold</b>" in page.words  # as text, not as markup
    assert "skipped" in page.words
    assert len(text) < 6_000_000


def test_a_bad_status_is_said_first(tmp_path):
    body = model()
    failed = deformation(body, Status.STAGNATED)
    text, page = write(tmp_path, ReportInputs("Failed", body, scenario(), failed, navigate(body, failed, Plan())))
    assert "The numbers and pictures below must not be used." in page.words
    assert text.index('role="alert"') < text.index('class="headlines"')
    assert "Status: stagnated" in page.words
    assert "No scan was given" in page.words


def test_a_report_without_a_stage_shows_the_scan_and_says_why(tmp_path):
    body = model(duct=None, wire_length_mm=None, tumours=(), trees=())
    nothing = Deformation(body.mesh, (), Status.SINGULAR, "Nothing holds the liver along x.")
    lonely = Scenario((), (Stage("gravity", ContactLaw()),))
    _, page = write(tmp_path, ReportInputs("Nothing", body, lonely, nothing, navigate(body, nothing, Plan())))
    assert "Nothing holds the liver along x." in page.words
    assert "There is no wire in the model" in page.words
    assert len(page.images) == 1
    assert "No contact was reported." in page.words


@pytest.mark.parametrize(
    ("value", "shown"), [(None, "–"), (-0.04, "0.0"), (-1.26, "−1.3"), (12.0, "12.0"), (0.05, "0.1")]
)
def test_numbers_for_people(value, shown):
    assert number(value) == shown


def test_points_and_hashes_for_people():
    assert point([0.6, -0.8, 0.0]) == "0.600, −0.800, 0.000"
    assert point([12.34, -5.0, 0.0]) == "12.3, −5.0, 0.0"
    assert shortened("sha256:" + "0123456789abcdef" * 4) == "sha256:0123456789ab…"
    assert shortened("a sentence that is long enough not to be taken for a hash") == (
        "a sentence that is long enough not to be taken for a hash"
    )
    assert shortened(None) == "–"

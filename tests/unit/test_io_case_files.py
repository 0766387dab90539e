import dataclasses
import json
import math
import tomllib
from types import MappingProxyType

import numpy as np
import pytest
from blocks import block

from conftest import ROOT
from glisson.core import (
    BadInput,
    Board,
    Capsule,
    ContactLaw,
    ContactReport,
    Curve,
    Cylinder,
    Deformation,
    Event,
    Lever,
    LeverDrive,
    LoadStep,
    Material,
    MeshTool,
    Model,
    Move,
    Observation,
    Observations,
    Rod,
    RodReport,
    Scenario,
    Slot,
    Stage,
    StageResult,
    Status,
    Structures,
    ToolMotion,
    TriangleSurface,
    Tumour,
    VesselTree,
)
from glisson.io.deformation_files import read_deformation, write_deformation
from glisson.io.model_files import read_model, write_model
from glisson.io.observation_files import read_observations, write_observations
from glisson.io.scenario_files import read_scenario, write_scenario


def same(one, other):
    """Whether two frozen types hold the same, array by array."""
    if dataclasses.is_dataclass(one):
        return type(one) is type(other) and all(
            same(getattr(one, item.name), getattr(other, item.name)) for item in dataclasses.fields(one)
        )
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other)
    if isinstance(one, (tuple, list)):
        return len(one) == len(other) and all(same(a, b) for a, b in zip(one, other, strict=True))
    if isinstance(one, (dict, MappingProxyType)):
        return set(one) == set(other) and all(same(one[key], other[key]) for key in one)
    if isinstance(one, float) and math.isnan(one):
        return math.isnan(other)
    return one == other


def scenario() -> Scenario:
    board = Board("board", [1.0, 95.3, -3.0], [0.0, -1.0, 0.0])
    bedding = Board("bedding", [0.0, 101.0, 0.0], [0.0, -1.0, 0.1], conforming=True)
    slotted = Board(
        "slotted", [0.0, 102.0, 0.0], [0.0, -1.0, 0.0], slot=Slot([1.0, 102.0, 3.0], [0.6, 0.0, 0.8], 90.0, 30.0)
    )
    jaw = Cylinder("jaw", [0.0, 50.0, 0.0], [10.0, 50.0, 1.0], 2.5)
    pad = MeshTool("pad", block((1, 1, 1), (5.0, 5.0, 5.0)).surface(), 0.75)
    lever = Lever.lifting(
        "lever", np.array([5.0, 80.0, 7.0]), np.array([1.0, 0, 0.2]), np.array([0, -1.0, 0]), length_mm=120.0
    )
    lift = Stage("lift", ContactLaw(0.5, 10.0), (LeverDrive("lever", angle_deg=25.0),), gravity=False)
    settle = Stage(
        "settle",
        ContactLaw(0.1),
        (LeverDrive("lever", force_n=2.5),),
        fixed=("back", "cut"),
        moves=(Move("tip", (1.5, 0.0, -2.0)),),
        gas_pressure_kpa=1.6,
        motions=(
            ToolMotion("jaw", (1.0, 2.0, -3.5)),
            ToolMotion("pad", turn_deg=(0.0, 12.0, 0.0), about_mm=(1.0, 2.0, 3.0)),
        ),
    )
    return Scenario(
        (board, bedding, slotted, lever, jaw, pad), (lift, settle), [0, 1, 0], None, ("board",), "as-scanned"
    )


def model(quadratic=False) -> Model:
    mesh = block((2, 2, 1), (40.0, 30.0, 20.0))
    mesh = dataclasses.replace(mesh, regions=np.arange(len(mesh.tetrahedra)) % 2)
    surface = block((1, 1, 1), (5.0, 5.0, 5.0), (10.0, 10.0, 5.0)).surface()
    tree = VesselTree("portal", np.random.default_rng(1).random((4, 3)), [3.0, 2.0, 2.0, 1.0], [[0, 1], [1, 2], [1, 3]])
    return Model(
        mesh.as_quadratic() if quadratic else mesh,
        {0: Material("neo-hookean", 7.1, 0.45), 1: Material("linear-elastic", 1 / 3, 0.3, 0.0)},
        {0: "liver", 1: "tumour"},
        {"back": np.array([0, 3, 5]), "none": np.array([], dtype=np.int64)},
        Structures(
            (Tumour("tumour1", surface),),
            (tree,),
            Curve(np.random.default_rng(2).random((5, 3))),
            31.7,
            {"falciform": Curve(np.random.default_rng(3).random((4, 3)))},
        ),
        Capsule(900.0, 0.2),
        {"back": 2.5},
        Rod(12.5, 80.0, 0.2, 0.01),
        ("back",),
    )


def deformation() -> Deformation:
    mesh = block((2, 1, 1), (20.0, 10.0, 10.0)).as_quadratic()
    rng = np.random.default_rng(4)
    contact = ContactReport("lever", (0.1, -2.0, 1 / 3), 12.0, 3.0, 0.01, 0.8, 0.2, 24.9, 0.31)
    away = ContactReport("board", (0.0, 0.0, math.nan), 0.0, math.nan, None, math.nan, 0.0)
    stages = (
        StageResult(
            "lift", rng.normal(size=mesh.nodes.shape), Status.CONVERGED, (contact, away), RodReport(1.5, 2.0, -0.3)
        ),
        StageResult("settle & slide <2>", rng.normal(size=mesh.nodes.shape), Status.STAGNATED),
    )
    record = (
        LoadStep("lift", 0.5, 7, 3e-9, 12.5, Status.CONVERGED),
        LoadStep("x", 1.0, 50, math.nan, 1.0, Status.INVERTED),
    )
    events = (Event("lost_contact", "lever", 23.5), Event("stuck", "board", None))
    error = rng.uniform(size=len(mesh.nodes))
    return Deformation(mesh, stages, Status.STAGNATED, "The residual stagnated in stage settle.", record, events, error)


def observations() -> Observations:
    rng = np.random.default_rng(3)
    roots = rng.random((3, 3, 3))
    spread = roots @ roots.transpose(0, 2, 1)
    full = Observation("surface", "", rng.random((3, 3)), 0.5, "room", 1.25, rng.random((3, 3)), spread)
    return Observations((full, Observation("landmark", "tip", rng.random((1, 3)), 2.0, "room")))


def test_round_trip_of_a_scenario(tmp_path):
    write_scenario(tmp_path / "scenario.toml", scenario())
    back = read_scenario(tmp_path / "scenario.toml")
    # Unit vectors are made unit again on reading: the last digit may move.
    for one, other in zip(scenario().tools, back.tools, strict=True):
        for item in dataclasses.fields(one):
            value = getattr(one, item.name)
            if isinstance(value, Slot | TriangleSurface):
                assert same(value, getattr(other, item.name))
            elif isinstance(value, np.ndarray):
                assert np.allclose(value, getattr(other, item.name), rtol=0, atol=1e-15 * 200)
            else:
                assert value == getattr(other, item.name)
    assert same(scenario().stages, back.stages)
    assert same(scenario().scan_gravity, back.scan_gravity)
    assert back.surgery_gravity is None
    assert (back.scan_supports, back.rest_shape) == (("board",), "as-scanned")


def test_the_keys_of_a_scenario_are_the_agreed_ones(tmp_path):
    write_scenario(tmp_path / "scenario.toml", scenario())
    table = tomllib.loads((tmp_path / "scenario.toml").read_text())
    assert table["schema"] == 1
    tools = {"boards", "levers", "cylinders", "mesh_tools"}
    assert set(table) == {"schema", "rest_shape", "scan_gravity", "scan_supports", "stages"} | tools
    expected = {"name", "friction", "cohesion_kpa", "gravity", "fixed", "drives", "moves", "gas_pressure_kpa"}
    assert set(table["stages"][0]) == expected | {"motions"}
    assert table["stages"][1]["drives"] == [{"lever": "lever", "force_n": 2.5}]


def test_the_scenario_of_the_docs_is_one(tmp_path):
    text = (ROOT / "docs" / "scenario.md").read_text().split("```toml\n")[1].split("```")[0]
    (tmp_path / "scenario.toml").write_text(text)
    scenario = read_scenario(tmp_path / "scenario.toml")
    board, lever, jaw, wedge = scenario.tools
    assert [tool.name for tool in scenario.tools] == ["board", "lever", "jaw", "wedge"]
    np.testing.assert_allclose(lever.up, [0.0, -1.0, 0.0])  # the tip goes to the front, away from the board
    assert wedge.surface.volume_mm3 == pytest.approx(20.0**3 / 6.0)
    assert scenario.stages[1].motions[0].tool == jaw.name
    assert board.slot.width_mm == 30.0


def test_sizes_and_forces_that_are_no_numbers_are_refused():
    with pytest.raises(BadInput, match="needs positive sizes"):
        Lever("l", np.zeros(3), np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0]), width_mm=math.nan)
    with pytest.raises(BadInput, match="not inf N"):
        LeverDrive("l", force_n=math.inf)


@pytest.mark.parametrize(
    ("stage", "complaint"),
    [
        (Stage("s", ContactLaw(), (LeverDrive("l", 5.0), LeverDrive("l", 9.0))), "drives lever 'l' twice"),
        (Stage("s", ContactLaw(), moves=(Move("a", (1, 0, 0)), Move("a", (2, 0, 0)))), "moves node set 'a' twice"),
    ],
)
def test_two_goals_for_one_thing_are_refused(stage, complaint):
    lever = Lever.lifting("l", np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0]))
    with pytest.raises(BadInput, match=complaint):
        Scenario((lever,), (stage,))


def test_a_scenario_by_hand_takes_the_defaults(tmp_path):
    (tmp_path / "s.toml").write_text(
        'schema = 1\n[[stages]]\nname = "rest"\n[[boards]]\nname = "b"\npoint_mm = [0, 1, 2]\nnormal = [0, -1, 0]\n'
    )
    found = read_scenario(tmp_path / "s.toml")
    assert found.stages == (Stage("rest", ContactLaw()),)
    assert found.rest_shape == "from-gravity"
    assert found.scan_gravity is None


@pytest.mark.parametrize("quadratic", [False, True])
def test_round_trip_of_a_model(tmp_path, quadratic):
    write_model(tmp_path / "mesh", model(quadratic))
    assert same(read_model(tmp_path / "mesh"), model(quadratic))
    assert sorted(entry.name for entry in (tmp_path / "mesh").iterdir()) == ["model.json", "model.vtu"]


def test_round_trip_of_a_model_without_structures(tmp_path):
    plain = dataclasses.replace(model(), structures=Structures(), rod=None)
    write_model(tmp_path, plain)
    assert same(read_model(tmp_path), plain)


def test_round_trip_of_a_deformation(tmp_path):
    (tmp_path / "report.html").write_text("stays")
    write_deformation(tmp_path, deformation())
    assert same(read_deformation(tmp_path), deformation())
    assert (tmp_path / "report.html").read_text() == "stays"


def test_round_trip_of_a_deformation_without_stages(tmp_path):
    none = Deformation(deformation().mesh, (), Status.SINGULAR, "Nothing holds it.")
    write_deformation(tmp_path, none)
    assert same(read_deformation(tmp_path), none)


def test_round_trip_of_observations(tmp_path):
    write_observations(tmp_path / "o.json", observations())
    assert same(read_observations(tmp_path / "o.json"), observations())
    write_observations(tmp_path / "o.json", Observations(()))
    assert same(read_observations(tmp_path / "o.json"), Observations(()))


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("schema = 1", "schema = 2", "made by a newer Glisson (schema 2, this one reads up to 1)"),
        ("schema = 1", "", "schema is missing"),
        ("schema = 1", 'schema = "1"', "schema must be a whole number, not '1'"),
        ("friction = 0.1", 'friction = "low"', "stages[1].friction must be a finite number, not 'low'"),
        ("friction = 0.1", "friction = nan", "stages[1].friction must be a finite number, not nan"),
        ("friction = 0.1", "friction = -0.1", "stages[1]: Friction must lie in 0 to 10"),
        ("friction = 0.1", "fricton = 0.1", "unknown key 'stages[1].fricton'"),
        ("gravity = false", "gravity = 1", "stages[0].gravity must be true or false, not 1"),
        ("angle_deg = 25.0", "angle_deg = 125.0", "stages[0].drives[0]: A lever turns by at most 90°"),
        ("angle_deg = 25.0", "force_n = 2.0, angle_deg = 25.0", "stages[0].drives[0]: Drive lever 'lever' either"),
        ("length_mm = 120.0", "length_mm = [1]", "levers[0].length_mm must be a finite number"),
        ('rest_shape = "as-scanned"', 'rest_shape = "relaxed"', "rest_shape must be from-gravity or as-scanned"),
        ('name = "settle"', "name = 3", "stages[1].name must be a text, not 3"),
        ('name = "settle"', 'name = "lift"', "Stages need different names"),
        ("thickness_mm = 8.0", "thickness = 8.0", "unknown key 'levers[0].thickness'"),
        ('name = "bedding"', 'name = "bedding"\ncolour = "red"', "unknown key 'boards[1].colour'"),
        ("schema = 1", "schema = 1\nstagess = 3", "unknown key 'stagess'"),
        ("schema = 1", "schema = = 1", "cannot be read as a scenario"),
    ],
)
def test_mistakes_in_a_scenario_are_named_by_their_key_path(tmp_path, old, new, complaint):
    path = tmp_path / "scenario.toml"
    write_scenario(path, scenario())
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(BadInput) as caught:
        read_scenario(path)
    assert complaint in str(caught.value)
    assert str(caught.value).startswith(str(path))


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda v: v.update(schema=9), "newer Glisson (schema 9"),
        (lambda v: v["materials"]["0"].update(poisson_ratio=0.5), "materials.0: Poisson's ratio"),
        (lambda v: v["materials"]["0"].update(law=None), "materials.0.law must be a text"),
        (lambda v: v["materials"].pop("1"), "Mesh regions [1] have no material"),
        (lambda v: v["materials"].update(liver=v["materials"]["0"]), "a region must be a whole number, not 'liver'"),
        (lambda v: v["node_sets"].update(back=[0, 999]), "Node set back points outside"),
        (lambda v: v["node_sets"].update(back=[0.5]), "node_sets.back must be whole numbers"),
        (lambda v: v["structures"]["tumours"][0].update(triangles=[[0, 1, 99]]), "structures.tumours[0]"),
        (lambda v: v["structures"]["trees"][0].update(radii_mm=[1]), "structures.trees[0]: vessel radii"),
        (lambda v: v["structures"].update(extra=1), "unknown key 'structures.extra'"),
        (lambda v: v["structures"].update(wire_length_mm=None), "structures: A wire needs a duct"),
    ],
)
def test_mistakes_in_a_model(tmp_path, change, complaint):
    write_model(tmp_path, model())
    values = json.loads((tmp_path / "model.json").read_text())
    change(values)
    (tmp_path / "model.json").write_text(json.dumps(values))
    with pytest.raises(BadInput) as caught:
        read_model(tmp_path)
    assert complaint in str(caught.value)
    assert "model.json" in str(caught.value)


def test_files_of_different_runs_are_not_taken_for_one(tmp_path):
    write_model(tmp_path, model())
    mesh = (tmp_path / "model.vtu").read_bytes()
    write_model(tmp_path, model(quadratic=True))
    (tmp_path / "model.vtu").write_bytes(mesh)
    with pytest.raises(BadInput, match=r"does not belong to the model\.vtu beside it"):
        read_model(tmp_path)
    (tmp_path / "model.vtu").unlink()
    with pytest.raises(BadInput, match=r"model\.vtu does not exist"):
        read_model(tmp_path)


def test_mistakes_in_observations(tmp_path):
    write_observations(tmp_path / "o.json", observations())
    values = json.loads((tmp_path / "o.json").read_text())
    values["items"][1]["frame"] = "patient"
    (tmp_path / "o.json").write_text(json.dumps(values))
    with pytest.raises(BadInput, match=r"o\.json: Observations mix the frames"):
        read_observations(tmp_path / "o.json")
    values["items"][1]["sigma_mm"] = True
    (tmp_path / "o.json").write_text(json.dumps(values))
    with pytest.raises(BadInput, match=r"items\[1\]\.sigma_mm must be a finite number, not True"):
        read_observations(tmp_path / "o.json")


def test_a_file_given_for_a_model_is_told(tmp_path):
    write_model(tmp_path, model())
    with pytest.raises(BadInput, match=r"model\.vtu is a file; give the folder with model\.vtu and model\.json"):
        read_model(tmp_path / "model.vtu")

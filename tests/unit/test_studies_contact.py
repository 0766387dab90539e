"""The study of two contacts: distributions over lifts on the same branch, other branches named, failures told."""

from glisson.core.status import Status
from glisson.studies.contact.study import ContactStudy
from glisson.studies.point import Outcome


def test_the_conclusion_tells_branches_apart() -> None:
    study = ContactStudy(seed=3, count=5)
    points = study.points({})

    def solved(apart: float, ours: str, other: str) -> Outcome:
        return Outcome({"our_branch": ours, "ipc_branch": other, "moved_mm": [9.0], "apart_mm": [apart, 7.0]})

    on, off = "on the lever", "slipped off"
    outcomes = [solved(0.1, on, on), solved(0.3, off, off), solved(8.0, on, off)]
    stuck = {"our_status": "converged", "ipc_status": "stagnated"}
    outcomes.append(Outcome(stuck, {}, Status.STAGNATED, Status.STAGNATED.sentence))
    done = {point.key: outcome for point, outcome in zip(points, outcomes, strict=False)}
    found = study.conclude({}, done)
    values = found.values
    assert values["apart_mm"]["median"] == 0.2
    assert values["apart_mm"]["worst"] == 0.3
    assert [row["apart_mm"] for row in values["other_branch"]] == [8.0]
    assert (values["lifts"], len(values["failed"]), values["unfinished"]) == (4, 1, 1)
    member = points[2].inputs["case"]["member"]
    assert f"member {member}: on the lever with ours, slipped off with ipctk; 8.00 mm apart" in found.text
    assert "ipctk stagnated" in found.text
    assert set(found.files) == {"rows.csv", "report.html"}

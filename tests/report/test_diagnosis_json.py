"""`diagnosis.json` has what contract section 5 promises, and nothing that JSON cannot hold."""

import json

import pytest
from report import synthetic_diagnosis

from wipx.core.diagnosis import Diagnosis
from wipx.report.diagnosis_json import diagnosis_json
from wipx.tasks.files.results import write_json

CONTRACT = {
    "": {"schema", "verdict", "effects", "location", "fit", "unexplained", "identifiability"},
    "effects": {"name", "parameters", "equivalent", "evidence", "present_probability"},
    "location": {"sites", "regions", "times"},
    "fit": {"horizon_s", "train", "heldout"},
    "unexplained": {"significant", "p_value", "site"},
    "identifiability": {"weak", "next_experiment"},
}
ADDED = {
    "": {"sentence", "source", "corrected", "bounds", "notes", "seconds", "combined", "suspects", "remainder", "minor"},
    "effects": {"share", "beyond_vocabulary", "unnamed", "rivals"},
    "location": set(),
    "fit": set(),
    "unexplained": {"shape", "resembles"},
    "identifiability": {"experiment"},
}


def written(diagnosis: Diagnosis, folder) -> dict:
    path = folder / "diagnosis.json"
    write_json(path, diagnosis_json(diagnosis))
    return json.loads(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    "make", [synthetic_diagnosis.mismatch, synthetic_diagnosis.consistent, synthetic_diagnosis.unexplained]
)
def test_keys_are_those_of_the_contract_and_the_added_ones(make, tmp_path):
    data = written(make(), tmp_path)
    parts = {"": [data], "effects": data["effects"], **{k: [data[k]] for k in CONTRACT if k not in ("", "effects")}}
    for part, holders in parts.items():
        for holder in holders:
            assert set(holder) == CONTRACT[part] | ADDED[part]
    for part in ("train", "heldout"):
        assert set(data["fit"][part]) == {"nominal", "completed", "noise_floor"}
    for effect in data["effects"]:
        assert set(effect["evidence"]) == {"log_evidence_gain", "heldout_gain"}
        assert all(set(value) == {"value", "ci95", "unit"} for value in effect["parameters"].values())


def test_values_are_those_of_the_diagnosis(tmp_path):
    data = written(synthetic_diagnosis.mismatch(), tmp_path)
    coulomb = data["effects"][0]
    assert data["schema"] == 1
    assert data["verdict"] == "mismatch"
    assert coulomb["parameters"] == {"F_c": {"value": 3.1042, "ci95": [2.93, 3.29], "unit": "N"}}
    assert sum(data["location"]["sites"].values()) == pytest.approx(1.0)
    assert data["location"]["times"] == [{"low": 4.9, "high": 10.0, "share": 0.98, "recording": "r3.csv"}]
    assert data["corrected"]["body_inertia"]["nominal"] == 0.11
    assert data["identifiability"]["next_experiment"].startswith("Is it a delay or a lag of the actuator? Let")


def test_suspects_are_written_with_all_their_numbers(tmp_path):
    named, absent = written(synthetic_diagnosis.asked(), tmp_path)["suspects"]
    assert named["named"]
    assert named["parameters"] == {"F_c": {"value": 3.1042, "ci95": [2.93, 3.29], "unit": "N"}}
    assert absent["sentence"] == "It is excluded."
    assert absent["evidence"] == {"log_evidence_gain": 0.6, "needed": 12.9, "heldout_gain": -0.01, "transfers": False}
    assert absent["suspected_size"] == {
        "values": {"sigma": 0.05},
        "loss": 230.0,
        "loss_to_free": 231.0,
        "against_free": False,
        "limit": 2.1,
        "excluded": True,
        "heldout_error_ratio": 3.1,
    }


def test_a_consistent_robot_has_no_effects_and_no_next_experiment(tmp_path):
    data = written(synthetic_diagnosis.consistent(), tmp_path)
    assert data["effects"] == []
    assert data["identifiability"]["next_experiment"] is None
    assert data["unexplained"]["site"] is None

"""Rules stand once: the dataclasses, the configuration and the page of them agree."""

from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from diagnosis.recorded import SIMULATOR, bench
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

from wipx.app import configuration_folder
from wipx.config import build, register
from wipx.core.errors import InputError
from wipx.diagnosis.pipeline import KnownRobot, diagnose
from wipx.diagnosis.rules import USUAL
from wipx.diagnosis.rules_page import page

ROOT = Path(__file__).resolve().parents[2]
DEFAULT = configuration_folder() / "diagnosis" / "default.yaml"
NAMES = [name for name, _, _ in USUAL.each()]


def test_the_configuration_holds_the_usual_rules():
    node = yaml.safe_load(DEFAULT.read_text())
    assert build(node, "diagnosis") == USUAL
    assert {f"{part}.{name}" for part in node if part != "_target_" for name in node[part]} == set(NAMES)


def test_a_rule_is_changed_on_the_command_line():
    register()
    with initialize_config_dir(str(configuration_folder()), version_base=None):
        composed = compose("config", overrides=["diagnosis.selection.least_share=0.02"]).diagnosis
    rules = build(OmegaConf.to_container(composed, resolve=True), "diagnosis")
    assert rules.selection.least_share == 0.02
    assert rules.without("selection.least_share") == USUAL.without("selection.least_share")


@pytest.mark.parametrize("value", [-0.1, float("nan")])
def test_a_rule_that_is_negative_or_no_number_is_refused(value: float):
    with pytest.raises(InputError, match=r"diagnosis\.trust\.noise_lasts is .*; expected zero or more \[s\]"):
        build({"_target_": "wipx.diagnosis.rules.Rules", "trust": {"noise_lasts": value}}, "diagnosis")


def test_an_unknown_rule_is_refused():
    node = {"_target_": "wipx.diagnosis.rules.Rules", "selection": {"least_shar": 0.02}}
    with pytest.raises(InputError, match=r"diagnosis\.selection.*least_share"):
        build(node, "diagnosis")


def test_a_diagnosis_keeps_to_the_rules_that_it_is_given(fresh_seed: int):
    case = bench("linear_axis", {"translation/coulomb": {"F_c": 1.0}}, fresh_seed)
    robot = KnownRobot(case.nominal, case.uncertainty)
    demanding = replace(USUAL, selection=replace(USUAL.selection, least_gain=1e6))
    answer = diagnose(case.recordings, robot, SIMULATOR, rules=demanding)
    assert "translation/coulomb" not in {effect.name for effect in answer.effects}
    assert answer.verdict == "unexplained"


def test_the_page_is_up_to_date():
    written = (ROOT / "docs" / "rules.md").read_text(encoding="utf-8")
    assert written == page(), "write it anew: python -m wipx.diagnosis.rules_page > docs/rules.md"


def test_every_rule_says_what_it_means_and_where_it_comes_from():
    for name, _, note in USUAL.each():
        assert note.meaning, name
        assert note.origin, name
        if note.neutral is not None:
            part, _, rule = name.partition(".")
            assert getattr(getattr(USUAL.without(name), part), rule) == note.neutral, name

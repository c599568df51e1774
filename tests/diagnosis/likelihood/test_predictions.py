"""What predictions of half a second see of a log."""

import numpy as np
import pytest
from diagnosis.recorded import bench, forecasts

from wipx.core.model import ModelBatch
from wipx.core.recording import Recording
from wipx.diagnosis.likelihood import predictions
from wipx.diagnosis.likelihood.predictions import condensed
from wipx.effects.catalogue import vocabulary
from wipx.identify.parameter_space import effect_parameters
from wipx.sim.coefficients import must_be_led


def test_a_fast_log_is_condensed_without_losing_time_or_level(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    t = np.arange(0.0, 2.0, 0.001)
    columns = {"t": t, "x": 3.0 * t + rng.normal(0.0, 1e-3, len(t)), "u": np.cos(t)}
    short = condensed(Recording("fast", columns), ("u",))
    assert 0.003 < np.median(np.diff(short.t)) < 0.006
    assert np.std(short["x"] - 3.0 * short.t) < 0.7e-3
    acting = [
        np.cos(t[(t >= a - 1e-9) & (t < b - 1e-9)]).mean() for a, b in zip(short.t[:-1], short.t[1:], strict=True)
    ]
    np.testing.assert_allclose(short["u"][:-1], acting, atol=1e-9)


@pytest.mark.parametrize("kind", ["wip", "double_pendulum"])
def test_models_that_need_not_be_led_to_a_start_predict_as_if_they_were(
    kind: str, monkeypatch: pytest.MonkeyPatch, fresh_seed: int
):
    case = bench(kind, {}, fresh_seed, count=2)
    seen = forecasts(case).predictions
    filters = [seen.filtered(case.nominal, np.full(2, 10.0))]
    for name in vocabulary(case.nominal.plant):
        numbers = effect_parameters(name, case.nominal.plant, case.setting.scales)
        model = case.nominal.with_effects({name: {p.name.rpartition(".")[2]: p.start for p in numbers}})
        batch = ModelBatch(model)
        if not must_be_led(batch):
            own = seen.errors(batch, filters)
            with monkeypatch.context() as patch:
                patch.setattr(predictions, "must_be_led", lambda batch: True)
                led = seen.errors(batch, filters)
            np.testing.assert_allclose(own, led, rtol=0.01, atol=1.0, err_msg=name)  # the sensor noise
            assert np.median(np.abs(own - led)) < 0.01, name

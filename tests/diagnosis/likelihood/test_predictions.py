"""What predictions of half a second see of a log."""

import numpy as np

from wipx.core.recording import Recording
from wipx.diagnosis.likelihood.predictions import condensed


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

"""Rich laws give way to the simple ones that they contain where nothing tells them apart."""

import numpy as np
import pytest
from diagnosis.recorded import bench, forecasts, shaken

from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.selection.fit_store import FitStore
from wipx.diagnosis.selection.search import Search

STIFF = {"translation/coulomb": {"F_c": 1.0}}
PEAKED = {"translation/stribeck": {"F_c": 0.6, "F_s": 1.8, "v_s": 0.1}}


@pytest.mark.parametrize(
    ("hidden", "rich", "left"),
    [
        (STIFF, "translation/presliding", "translation/coulomb"),
        (STIFF, "translation/stribeck", "translation/coulomb"),
        (PEAKED, "translation/stribeck", "translation/stribeck"),
    ],
    ids=["bristles too stiff to be seen", "no peak", "a peak"],
)
def test_forecasts_end_with_the_simple_law_unless_something_speaks_for_the_rich_one(
    hidden: dict[str, dict[str, float]], rich: str, left: str, fresh_seed: int
):
    rng = np.random.default_rng(fresh_seed)
    case = shaken(bench("linear_axis", hidden, fresh_seed, count=4, duration=4.0), rng)
    fitter = forecasts(case)
    nominal = fitter.first_fit(Hypothesis.of(case.setting, (), {}))
    search = Search.of(FitStore.of(fitter, case.setting, nominal), nominal)
    start = {f"{name}.{symbol}": value for name, own in hidden.items() for symbol, value in own.items()}
    fit = search.store.keep(fitter.first_fit(Hypothesis.of(case.setting, (rich,), start)))
    assert search.simplified(fit).fit.effects == (left,)

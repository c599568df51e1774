"""Stability margins of a closed loop that is broken at its command.

Broken there is the loop of a controller that knows the state: the filter is left out, which takes little of the
margins as long as it is much faster than the loop. Limits, dry friction, dead zone and backlash are left out too. The
command's hold, delay and lag are in.
"""

import numpy as np

from wipx.control.controller import LinearController
from wipx.control.sampled import SampledPlant, check_stabilises
from wipx.core.errors import InputError
from wipx.core.margins import Margins
from wipx.core.model import Model

SLOWEST = 1e-3  # [rad/s]; a robot's loop has done all it does far above
FREQUENCIES = 4000
REAL = 1e-3  # of the imaginary part, below which the response at an end of the band is real


def margins(controller: LinearController, model: Model) -> Margins:
    """Gain, phase and delay margin on a completed model.

    Args:
        controller: Its gains are those for the model's rigid body.
        model: The robot as it is known.

    Raises:
        InputError: the plant has several commands, or the loop is not stable.
    """
    import control

    if len(model.plant.commands) > 1:
        raise InputError(f"controller: margins are those of one command, a {model.plant.kind} has several")
    law = controller.law(model)
    check_stabilises(law, model, controller.rate)
    fastest = np.pi * controller.rate
    frequencies = np.geomspace(SLOWEST, fastest, FREQUENCIES)
    returned = SampledPlant.of(model, controller.rate).loop_transfer(law, frequencies)
    response = control.FrequencyResponseData(returned, frequencies, smooth=True)
    gains, phases, _, _, crossings, _ = control.stability_margins(response, returnall=True)
    gains = np.concatenate([gains, _at_the_ends(returned)])
    lags = np.deg2rad(np.mod(phases, 360.0))  # lag, always positive, that turns the response at a crossing to -1
    return Margins(
        gain_low=float(np.max(gains[gains < 1.0], initial=0.0)),
        gain_high=float(np.min(gains[gains > 1.0], initial=np.inf)),
        phase=float(np.min(np.minimum(lags, 2.0 * np.pi - lags), initial=np.pi)),
        delay=float(np.min(lags / crossings, initial=np.inf)),
    )


def _at_the_ends(returned: np.ndarray) -> np.ndarray:
    """Gains that bring the response to -1 at rest and at half the loop's rate, where it is real and crosses nothing."""
    ends = returned[[0, -1]]
    level, turned = np.real(ends), np.abs(np.imag(ends))
    return -1.0 / level[(level < 0.0) & (turned < -REAL * level)]

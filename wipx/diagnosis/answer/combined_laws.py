"""One law in the place of two effects: dry friction that differs by direction is Coulomb friction and a constant force.

Both are in the vocabulary, so that recordings which show the one show the other too. An answer that names the two must
say so.
"""

from wipx.core.diagnosis import Combined
from wipx.diagnosis.decision.context import Context
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.selection.search import Search

CONSTANT = ("rail_tilt", "com_offset", "bias", "offset")  # kinds that act as a constant force on a joint


def combined(context: Context, search: Search, fit: Fit) -> tuple[Combined, ...]:
    """Frictions that differ by direction which explain a Coulomb friction and a constant force of a fit as well."""
    found = []
    for friction in (effect for effect in fit.effects if effect.endswith("/coulomb")):
        for constant in (effect for effect in fit.effects if effect.partition("/")[2] in CONSTANT):
            name = f"{friction.partition('/')[0]}/asymmetric_coulomb"
            level = fit.hypothesis.values[f"{friction}.F_c"]
            rest = tuple(effect for effect in fit.effects if effect not in (friction, constant))
            start = {**fit.hypothesis.values, f"{name}.F_plus": level, f"{name}.F_minus": level}
            hypothesis = Hypothesis.of(context.setting, (*rest, name), start)
            other = context.fitter.converged(context.fitter.fit(hypothesis, context.fitter.escape_levels(fit)))
            lead = search.criteria.score_lead(other, fit)
            if lead > -0.5 * context.rules.answer.told_apart**2:
                values = other.hypothesis.values
                parameters = {symbol: values[f"{name}.{symbol}"] for symbol in ("F_plus", "F_minus")}
                found.append(Combined(name, (friction, constant), lead, parameters))
    return tuple(found)

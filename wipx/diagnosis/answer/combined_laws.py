"""One law in the place of two effects: dry friction that differs by direction is Coulomb friction and a constant force.

Both are in the vocabulary, so that recordings which show the one show the other too. An answer that names the two must
say so. Which laws are two (`Effect.with_constant`, `Effect.constant_force`) the effects say themselves.
"""

from wipx.core.diagnosis import Combined
from wipx.diagnosis.decision.context import Context
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.selection.nested_laws import laws_with_constants
from wipx.diagnosis.selection.search import Search
from wipx.effects.catalogue import kind_of


def combined(context: Context, search: Search, fit: Fit) -> tuple[Combined, ...]:
    """Laws that explain an effect of a fit and a constant force as well as these two."""
    found = []
    values = fit.hypothesis.values
    for effect, name, symbols in laws_with_constants(fit):
        for constant in (other for other in fit.effects if kind_of(other).constant_force):
            rest = tuple(other for other in fit.effects if other not in (effect, constant))
            start = {**values, **{f"{name}.{own}": values[f"{effect}.{other}"] for own, other in symbols.items()}}
            hypothesis = Hypothesis.of(context.setting, (*rest, name), start)
            other = context.fitter.converged(context.fitter.fit(hypothesis, context.fitter.escape_levels(fit)))
            lead = search.criteria.score_lead(other, fit)
            if lead > -0.5 * context.rules.answer.told_apart**2:
                parameters = {symbol: other.hypothesis.values[f"{name}.{symbol}"] for symbol in symbols}
                found.append(Combined(name, (effect, constant), lead, parameters))
    return tuple(found)

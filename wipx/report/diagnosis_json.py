"""A diagnosis as the data of `diagnosis.json`, contract section 5."""

from collections.abc import Mapping

from wipx.core.diagnosis import Bound, Diagnosis, FoundEffect, Location, Unexplained
from wipx.core.results import Estimate, FitErrors
from wipx.report.diagnosis_words import next_step, symbol_of

SCHEMA = 1


def diagnosis_json(diagnosis: Diagnosis) -> dict[str, object]:
    """What `diagnosis.json` holds, as dictionaries, lists, texts and plain numbers; numbers may be non-finite."""
    return {
        "schema": SCHEMA,
        "verdict": diagnosis.verdict,
        "sentence": diagnosis.sentence,
        "source": diagnosis.source,
        "effects": [_effect(effect) for effect in diagnosis.effects],
        "corrected": {
            number.name: {"nominal": float(number.nominal), **_value(number)} for number in diagnosis.corrected
        },
        "location": _location(diagnosis.location),
        "fit": {
            "horizon_s": float(diagnosis.fit.horizon),
            "train": _errors(diagnosis.fit),
            "heldout": _errors(diagnosis.held_out),
        },
        "unexplained": _unexplained(diagnosis.unexplained),
        "bounds": [_bound(bound) for bound in diagnosis.bounds],
        "identifiability": {"weak": list(diagnosis.weak), "next_experiment": next_step(diagnosis.next_experiment)},
        "notes": list(diagnosis.notes),
        "seconds": float(diagnosis.seconds),
    }


def _effect(effect: FoundEffect) -> dict[str, object]:
    return {
        "name": effect.name,
        "parameters": {symbol_of(number.name): _value(number) for number in effect.parameters},
        "equivalent": list(effect.equivalent),
        "evidence": {
            "log_evidence_gain": float(effect.log_evidence_gain),
            "heldout_gain": float(effect.heldout_gain),
        },
        "present_probability": float(effect.present_probability),
        "share": float(effect.share),
        "beyond_vocabulary": bool(effect.beyond),
        "rivals": [
            {"name": rival.name, "separation": float(rival.separation), "parameters": _floats(rival.parameters)}
            for rival in effect.rivals
        ],
    }


def _value(number: Estimate) -> dict[str, object]:
    return {"value": float(number.value), "ci95": [float(number.low), float(number.high)], "unit": number.unit}


def _location(location: Location) -> dict[str, object]:
    return {
        "sites": _floats(location.sites),
        "regions": [
            {"signal": r.signal, "low": float(r.low), "high": float(r.high), "share": float(r.share)}
            for r in location.regions
        ],
        "times": [
            {"low": float(p.low), "high": float(p.high), "share": float(p.share), "recording": p.recording}
            for p in location.times
        ],
    }


def _errors(errors: FitErrors) -> dict[str, object]:
    return {
        "nominal": _floats(errors.nominal),
        "completed": _floats(errors.completed),
        "noise_floor": _floats(errors.noise_floor),
    }


def _unexplained(left: Unexplained) -> dict[str, object]:
    return {
        "significant": bool(left.significant),
        "p_value": float(left.p_value),
        "site": left.site,
        "shape": left.shape,
        "resembles": list(left.resembles),
    }


def _bound(bound: Bound) -> dict[str, object]:
    return {"name": bound.name, "ci95": [float(bound.low), float(bound.high)], "unit": bound.unit}


def _floats(values: Mapping[str, float]) -> dict[str, float]:
    return {name: float(value) for name, value in values.items()}

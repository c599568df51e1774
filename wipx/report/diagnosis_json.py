"""A diagnosis as the data of `diagnosis.json`, contract section 5."""

from collections.abc import Mapping

from wipx.core.diagnosis import Bound, Diagnosis, FoundEffect
from wipx.core.location import Location
from wipx.core.next_experiment import NextExperiment
from wipx.core.remainder import Remainder, Unexplained
from wipx.core.results import Estimate, FitErrors
from wipx.core.suspect import Suspect, SuspectedSize
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
        "minor": [_effect(effect) for effect in diagnosis.minor],
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
        "remainder": None if diagnosis.remainder is None else _remainder(diagnosis.remainder),
        "bounds": [_bound(bound) for bound in diagnosis.bounds],
        "combined": [
            {
                "name": one.name,
                "instead_of": list(one.instead_of),
                "lead": float(one.lead),
                "parameters": _floats(one.parameters),
            }
            for one in diagnosis.combined
        ],
        "suspects": [_suspect(suspect) for suspect in diagnosis.suspects],
        "identifiability": {
            "weak": list(diagnosis.weak),
            "next_experiment": next_step(diagnosis.next_experiment),
            "experiment": _next_experiment(diagnosis.next_experiment),
        },
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
        "beyond_vocabulary": bool(effect.outside_vocabulary),
        "unnamed": effect.unnamed,
        "rivals": [
            {"name": rival.name, "separation": float(rival.separation), "parameters": _floats(rival.parameters)}
            for rival in effect.rivals
        ],
    }


def _next_experiment(following: NextExperiment | None) -> dict[str, object] | None:
    if following is None:
        return None
    return {
        "name": following.best.name,
        "reference": list(following.reference),
        "release": float(following.release),
        "mass": float(following.mass),
        "repeats": following.repeats,
    }


def _value(number: Estimate) -> dict[str, object]:
    found = {"value": float(number.value), "ci95": [float(number.low), float(number.high)], "unit": number.unit}
    if number.from_run_to_run is not None:
        found["from_run_to_run"] = [float(end) for end in number.from_run_to_run]
    return found


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


def _remainder(left: Remainder) -> dict[str, object]:
    return {
        "share_gone": float(left.share_gone),
        "times_floor": _floats(left.times_floor),
        "matters": bool(left.matters),
        "horizons": [
            {"horizon_s": float(e.horizon), "nominal": _floats(e.nominal), "completed": _floats(e.completed)}
            for e in left.horizons
        ],
        "forces": [
            {
                "site": force.site,
                "rms": float(force.size),
                "unit": force.unit,
                "correlation_time_s": float(force.lasting),
                "kind": force.kind,
                "signal": force.signal,
                "period": None if force.period is None else float(force.period),
                "share": float(force.share),
            }
            for force in left.forces
        ],
    }


def _bound(bound: Bound) -> dict[str, object]:
    return {"name": bound.name, "ci95": [float(bound.low), float(bound.high)], "unit": bound.unit}


def _suspect(suspect: Suspect) -> dict[str, object]:
    return {
        "name": suspect.name,
        "sentence": suspect.sentence,
        "named": suspect.named and suspect.unnamed is None,
        "in_place_of": list(suspect.in_place_of),
        "parameters": {symbol_of(number.name): _value(number) for number in suspect.parameters},
        "evidence": {
            "log_evidence_gain": float(suspect.log_evidence_gain),
            "needed": float(suspect.required_gain),
            "heldout_gain": float(suspect.heldout_gain),
            "transfers": suspect.transfers,
        },
        "loss": float(suspect.loss),
        "suspected_size": None if suspect.size is None else _suspected_size(suspect.size),
    }


def _suspected_size(size: SuspectedSize) -> dict[str, object]:
    return {
        "values": _floats(size.values),
        "loss": float(size.loss),
        "loss_to_free": float(size.loss_to_free),
        "against_free": size.against_free,
        "limit": float(size.limit),
        "excluded": size.excluded,
        "heldout_error_ratio": float(size.error_ratio),
    }


def _floats(values: Mapping[str, float]) -> dict[str, float]:
    return {name: float(value) for name, value in values.items()}

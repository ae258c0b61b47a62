"""Trial of one stranger: makes the campaign of a seed, diagnoses it as `stickslip diagnose` and returns a record.

Thresholds are those of linear theory (`--trials 0`), because the thresholds of an unknown layout would take 40 further
diagnoses. A structure with two hidden effects is diagnosed again after the named effect was added (`stickslip add`; of
several that the data cannot separate, the first), with at most `ROUNDS` diagnoses.
"""

import tempfile
import time
import traceback
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.processor_time import TimeUp, limited
from benchmarks.strangers.campaign import make
from benchmarks.strangers.hidden import Hidden
from correlation.campaign.read_campaign import read_campaign
from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.diagnose import Diagnosis
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.problem import Refit
from diagnosis.screening import make_calibration_basis, project_out
from diagnosis.unknown_force import compute_excess_gain
from study.diagnose.add import add
from study.diagnose.run import diagnose_file

#: Largest processor time of one diagnosis [s]; |cos| above which two effects are the same; largest number of rounds;
#: largest number of recorded gains.
LIMIT, SAME, ROUNDS, MOST = 300.0, 0.95, 3, 10


def run(seed: int, keep: Path | None = None, trials: int = 0) -> Mapping[str, Any]:
    """Make the record of a seed; an exception becomes its "failure".

    Parameters
    ----------
    seed
        Seed of the stranger.
    keep
        Folder for case and campaign, in a subfolder of the seed; they are deleted by default.
    trials
        Number of simulated campaigns for the thresholds, as in `stickslip diagnose`.
    """
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) if keep is None else keep / str(seed)
        folder.mkdir(parents=True, exist_ok=True)
        try:
            stranger = make(seed, folder)
        except Exception as error:
            return {"seed": seed, "made": False, "failure": _told(error)}
        record: dict[str, Any] = {**stranger.truth, "made": True, "rounds": []}
        names = [item.name for item in stranger.hidden]
        for _ in range(ROUNDS if len(names) > 1 else 1):
            begin, done = time.process_time(), {}
            try:
                with limited(LIMIT):
                    result = diagnose_file(
                        stranger.case, read_campaign(stranger.folder), stranger.folder, trials=trials
                    )
                    done = describe_round(result.last.diagnosis, stranger.hidden)
            except TimeUp as end:
                done = {"finding": "failed", "failure": str(end)}
            except Exception as error:
                done = {"finding": "failed", "failure": _told(error)}
            record["rounds"].append({**done, "seconds": time.process_time() - begin})
            if len(names) < 2 or not done.get("named"):
                break
            try:
                add(stranger.case, done["named"][0]["name"])
            except Exception as error:
                record["rounds"].append({"finding": "failed", "failure": _told(error), "seconds": 0.0})
                break
        return record


def describe_round(diagnosis: Diagnosis[Arrangement], effects: Sequence[Hidden]) -> dict[str, Any]:
    """Record of one diagnosis, with the visibility of the hidden effects and the effects inseparable from them."""
    verdict, before, hidden = diagnosis.verdict, diagnosis.baseline, [item.name for item in effects]
    detectable = {score.effect.name: score.detectable for score in diagnosis.scores}
    directions = {score.effect.name: score.direction for score in diagnosis.scores}
    return {
        "finding": verdict.finding.value,
        "sentence": verdict.sentence,
        "named": [_fitted(item) for item in verdict.effects if item.effect is not None],
        "further": None if verdict.further is None else _fitted(verdict.further),
        "probabilities": [*verdict.probabilities],
        "ranking": [_fitted(item) for item in diagnosis.refits if item.effect is not None],
        "scores": {score.effect.name: float(score.gain) for score in diagnosis.scores[:MOST]},
        "seen": {
            item.name: abs(item.strength - item.vanishes) / detectable[item.name]
            if item.name in detectable
            else _measure_change(diagnosis.arrangement, item)
            for item in effects
        },
        "alike": {
            name: [
                other
                for other, direction in directions.items()
                if other != name and abs(float(direction @ directions[name])) > SAME
            ]
            for name in hidden
            if name in directions
        },
        "place": None if verdict.place is None else verdict.place.name,
        "threshold": verdict.threshold,
        "misfit": max((compute_excess_gain(item) for item in diagnosis.places), default=0.0),
        "misfit_threshold": diagnosis.thresholds.misfit,
        "before": _judged(before),
    }


def _measure_change(arrangement: Arrangement, effect: Hidden) -> float:
    """Norm of the whitened change by an effect that the catalogue lacks, calibration parameters projected out [-]."""
    train, fit, whole = arrangement.train, arrangement.fit, arrangement.fit.residual
    prediction = train.predict(effect.bound(fit.model)(fit.model))
    there = train.has_prediction(prediction) & train.has_prediction(fit.prediction)
    change = np.where(there, train.residual(prediction) - whole[: len(there)], 0.0)
    padded = np.pad(change, (0, len(whole) - len(change)))
    return float(np.linalg.norm(project_out(make_calibration_basis(arrangement), padded)))


def _fitted(refit: Refit) -> dict[str, Any]:
    assert refit.effect is not None
    return {
        "name": refit.name,
        "strength": refit.strength,
        "half": TWO_SIDED_95 * refit.deviation,
        "gain": refit.gain,
        "held_gain": refit.held_out_gain,
        "finite": bool(np.isfinite([refit.strength, refit.deviation]).all()),
        **_judged(refit),
    }


def _judged(refit: Refit) -> dict[str, Any]:
    """Quality of a fit on training and held-out data: chi-squared with and without model error, and relative error."""
    return {
        "chi2": float(refit.fit.chi2 / refit.fit.n_number),
        "held_chi2": float(refit.held_out_reduced_chi2),
        "stated_chi2": refit.reduced_chi2_without_model_error,
        "held_stated_chi2": refit.held_out_reduced_chi2_without_model_error,
        "error": float(refit.error),
        "held_error": float(refit.held_out_error),
    }


def _told(error: Exception) -> str:
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({Path(last.filename).name}, line {last.lineno})"[:500]

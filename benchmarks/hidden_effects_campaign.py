"""One campaign of the hidden-effect test: made on the virtual test bench, diagnosed and recorded."""

import hashlib
import shutil
import time
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.hidden_effects_groups import Groups
from benchmarks.hidden_effects_plan import KIND, Case, effect_name, effect_value
from benchmarks.hidden_effects_record import FAILED, Fitted, Found, Planted, Record
from benchmarks.hidden_effects_setup import setup
from correlation.campaign.measurement import Campaign
from correlation.campaign.read_campaign import read_campaign
from correlation.feature.vector import FeatureVector
from correlation.model import Model
from diagnosis.diagnose import Diagnosis, diagnose
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.problem import Refit
from diagnosis.localisation import UnknownForcePlace
from diagnosis.threshold.detection_threshold import Thresholds
from study.diagnose.thresholds import find_shipped_thresholds
from transient.virtual_bench.hidden_effect import HiddenEffectRecord, make_campaign

#: Packages whose code a result depends on.
PACKAGES = ("reduction", "hbsolve", "transient", "correlation", "diagnosis")
#: Largest number of recorded gains of the screening.
MOST_SCORES = 10


def limits(campaign: Campaign, without: Sequence[str]) -> Thresholds | None:
    """Detection thresholds shipped for the layout, else those for the layout with the full catalogue.

    The thresholds of the full catalogue are higher, because more candidates can fit by chance.

    Parameters
    ----------
    campaign
        Campaign as read.
    without
        Kinds of effects that are excluded from the catalogue.
    """
    return find_shipped_thresholds(setup(), campaign, without) or find_shipped_thresholds(setup(), campaign, ())


@cache
def code() -> str:
    """Digest of the code of the program, which identifies results of different versions."""
    digest = hashlib.sha256()
    root = Path(__file__).parents[1]
    for package in PACKAGES:
        for file in sorted((root / package).rglob("*.py")):
            digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


def examine(
    case: Case,
    folder: Path,
    groups: Groups,
    *,
    make: Callable[..., HiddenEffectRecord] = make_campaign,
    judge: Callable[..., Diagnosis] = diagnose,
) -> Record:
    """Make a campaign, diagnose it and delete it.

    Parameters
    ----------
    case
        Row and seed of the campaign.
    folder
        Folder for the temporary folder of the campaign.
    groups
        Groups of effects that the layout cannot separate; they are excluded together.
    make, judge
        Functions like `transient.virtual_bench.hidden_effect.make_campaign` and `diagnosis.diagnose.diagnose`.

    Returns
    -------
    Record of the campaign; an exception becomes its `failure`.
    """
    started, where = time.process_time(), folder / f"{case.row}_{case.seed}"
    planted, made = Planted(kind=case.kind), started
    without: tuple[str, ...] = ()
    try:
        model = setup()
        truth = make(where, seed=case.seed, kind=case.kind)
        made = time.process_time()
        planted = _planted(truth, model.model)
        without = excluded_kinds(planted.effect, groups) if case.excluded else ()
        campaign = read_campaign(where)
        diagnosis = judge(
            campaign,
            model.model,
            model.calibration_parameters,
            model.budget,
            without=without,
            thresholds=limits(campaign, without),
        )
        return _record(case, planted, without, diagnosis, (made - started, time.process_time() - made))
    except Exception as error:
        return Record(
            row=case.row, seed=case.seed, planted=planted, without=without, finding=FAILED, code=code(),
            failure=f"{type(error).__name__}: {error} ({_where(error)})",
            make_seconds=(made if made > started else time.process_time()) - started,
            diagnose_seconds=time.process_time() - made if made > started else 0.0,
        )  # fmt: skip
    finally:
        with suppress(OSError):
            shutil.rmtree(where)


def _where(error: Exception) -> str:
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{Path(last.filename).name}, line {last.lineno}"


def excluded_kinds(effect: str, groups: Groups) -> tuple[str, ...]:
    """Kinds to exclude from the catalogue for an effect and its group; none for an effect that has no name there."""
    return tuple(sorted({kind_of(item) for item in (effect, *groups.of(effect))})) if effect else ()


def kind_of(effect: str) -> str:
    """Kind of an effect: the part of its name before " at " or " of "."""
    return min((effect.partition(f" {word} ")[0] for word in ("at", "of")), key=len)


def _planted(truth: HiddenEffectRecord, base: Model) -> Planted:
    return Planted(
        kind=truth.effect.kind,
        place=truth.effect.place,
        strength=truth.effect.strength,
        unit=truth.unit,
        unit_strength=truth.unit_strength,
        effect=effect_name(truth, base),
        value=effect_value(truth) if truth.effect.kind in KIND else 0.0,
    )


def _record(
    case: Case, planted: Planted, without: tuple[str, ...], found: Diagnosis, seconds: tuple[float, float]
) -> Record:
    verdict, before = found.verdict, found.baseline
    place = next((item for item in (verdict.place, *found.places) if isinstance(item, UnknownForcePlace)), None)
    floor, noise_floor = floors(found.arrangement)
    return Record(
        row=case.row,
        seed=case.seed,
        planted=planted,
        without=without,
        finding=verdict.finding.value,
        sentence=verdict.sentence,
        named=tuple(_fitted(item) for item in verdict.effects if item.effect is not None),
        ranking=tuple(_fitted(item) for item in found.refits if item.effect is not None),
        scores={score.effect.name: round(float(score.gain), 2) for score in found.scores[:MOST_SCORES]},
        error=float(before.error),
        held_error=float(before.held_out_error),
        held_chi2=float(before.held_out_reduced_chi2),
        floor=floor,
        noise_floor=noise_floor,
        threshold=float(verdict.threshold),
        place=None if place is None else Found(
            name=place.name,
            gain=float(place.gain),
            exponent=float(place.exponent),
            exponent_deviation=float(place.exponent_deviation),
            phase=np.nan if place.phase is None else place.phase,
            configuration=place.configuration,
        ),
        code=code(),
        make_seconds=seconds[0],
        diagnose_seconds=seconds[1],
    )  # fmt: skip


def _fitted(refit: Refit) -> Fitted:
    effect = refit.effect
    assert effect is not None
    return Fitted(
        effect=effect.name,
        kind=effect.kind,
        strength=refit.strength,
        deviation=refit.deviation,
        vanishes=float(effect.parameters[0].vanishes),
        gain=refit.gain,
        error=float(refit.error),
        held_error=float(refit.held_out_error),
        held_chi2=float(refit.held_out_reduced_chi2),
    )


def floors(arrangement: Arrangement) -> tuple[float, float]:
    """Relative error of the true model on the held-out data, as defined by `Refit.held_out_error`.

    Returns
    -------
    Error from the whole covariance (noise, friction histories, numerical error), and from the noise alone [-].
    """
    held_out = arrangement.held_out_without_jitter
    features, modes = held_out.features, held_out.whitening.modes
    chosen, ratio = features.fundamental, features.reference >= 0
    # Independent errors: the variances of real and imaginary part add.
    alone = np.abs(_complex(features, held_out.measured, held_out.whitening.deviation)) ** 2
    alone[ratio] += alone[features.reference[ratio]]
    shared = np.zeros(len(chosen))
    for mode in modes.T if modes is not None else ():
        shared += np.abs(_through_reference(features, _complex(features, held_out.measured, mode))) ** 2
    shares = held_out.shares[chosen]
    return float(np.sqrt(shares @ (alone + shared)[chosen])), float(np.sqrt(shares @ alone[chosen]))


def _complex(
    features: FeatureVector, measured: NDArray[np.float64], change: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Relative change of each feature, shape (k,)."""
    k, row = len(features.points), features.row
    both = np.zeros((2, k), dtype=np.complex128)
    for part, numbers in zip(both, (measured, change), strict=True):
        part += numbers[:k]
        part[row[k:]] += 1j * numbers[k:]
    return np.asarray(both[1] / np.where(both[0] == 0, 1.0, both[0]))


def _through_reference(features: FeatureVector, relative: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Relative change of the readings from that of the features.

    An inverse feature F / X decreases as X increases; the change of a ratio is added to that of its reference.
    """
    changed = np.where(features.inverse, -relative, relative)
    ratio = features.reference >= 0
    changed[ratio] += changed[features.reference[ratio]]
    return changed


def summary(record: Record) -> str:
    """One line of progress."""
    cost = record.make_seconds + record.diagnose_seconds
    result = record.failure or ": ".join([record.finding, *([" or ".join(record.names)] if record.named else [])])
    return f"{record.row} {record.seed}: {result} ({cost:.0f} CPU s)"

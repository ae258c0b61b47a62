"""Spread of response and limits of a case over the distributions of its uncertain parameters."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from correlation.uncertainty.variance_index import make_saltelli_design
from pipeline.worker_pool import Workers
from study.case.setup import read_case
from study.kind.registry import OpenCase, open_case
from study.run_context import RunContext, silent_run
from study.solve.curve import response_curve
from study.solve.model import SolveModel, make_solve_model
from study.solve.refinement import refine_curve
from study.spread.band import CurveBand, make_curve_bands
from study.spread.quantity import QuantitySpread, list_quantities
from study.spread.sensitivity import CurveSensitivity, differentiate_curve, model_tangents
from study.spread.uncertain import Uncertain, check_draws, read_uncertain
from study.sweep.limits import asks_for_limits, compute_limits
from study.sweep.parameter import refuse, require_factors, vary
from study.sweep.result import SampledCase
from study.sweep.run import require_curves_or_limits, warn_of_failures
from study.sweep.samples import compute_curves

#: Largest number of computed points, n (d + 2) for n draws of d parameters.
MOST_POINTS = 20_000


@dataclass(frozen=True, kw_only=True, eq=False)
class Spread:
    """Spread of the response of a case.

    Parameters
    ----------
    uncertain
        Uncertain parameters.
    draws
        Number of draws n [-]; 0 for only first order.
    sampled
        Curves and limits at the means, and then at the n (d + 2) points of the design.
    sensitivities
        Derivatives of each curve at the means.
    quantities
        Peaks, damping and limits, each with its spread.
    bands
        Band of each curve.
    files
        Written files.
    """

    uncertain: Uncertain
    draws: int
    sampled: SampledCase
    sensitivities: tuple[CurveSensitivity, ...]
    quantities: tuple[QuantitySpread, ...]
    bands: tuple[CurveBand, ...]
    files: tuple[Path, ...] = ()


def spread(
    path: Path | str,
    *,
    draws: int = 64,
    seed: int = 0,
    limits: bool | None = None,
    run: RunContext | None = None,
    workers: Workers = 1,
) -> Spread:
    """Compute the spread of the response over the distributions of `[[uncertain]]`; nothing is written.

    Parameters
    ----------
    path
        Case file.
    draws
        Number n of draws, a power of two; n (d + 2) points of d parameters are computed. 0 for only first order.
    seed
        Seed of the draws.
    limits
        Whether limits are searched for at every point; by default if the case has a table [limits].
    run
        Store and progress; none by default.
    workers
        Number of processes [-]; only this process by default. With more, or None for one per core, a script needs
        ``if __name__ == "__main__":``. Or the address of a dask scheduler.

    Raises
    ------
    CaseError
        If the case has mistakes; the error lists all of them. Or an invalid number of draws.
    ComputationFailed
        No curve could be started.
    """
    opened = open_case(path)
    run = run or silent_run()
    uncertain = read_uncertain(opened)
    d = len(uncertain.parameters)
    _check_number(opened, draws, d)
    with_limits = asks_for_limits(opened) if limits is None else limits
    require_curves_or_limits(opened, with_limits=with_limits)
    values = uncertain.mean[None]
    if draws:
        values = np.concatenate([values, uncertain.draws(make_saltelli_design(draws, d, seed).points)])
    check_draws(opened, uncertain, values)
    require_factors(read_case(opened, run=run), uncertain.parameters)
    mean = vary(opened, uncertain.at(uncertain.mean.tolist()))
    read = read_case(mean, run=run)
    points = [uncertain.at(row.tolist()) for row in values]
    curves, sensitivities = None, tuple[CurveSensitivity, ...]()
    if opened.case.sweep is not None:
        model = make_solve_model(read)
        sensitivities = _compute_sensitivities(opened, uncertain, model, run)
        curves = compute_curves(opened, points, model, run, workers)
        warn_of_failures(curves.failures, len(points) * len(model.curves), run)
    result = compute_limits(opened, points, Path(path).stem, run, workers) if with_limits else ()
    sampled = SampledCase(parameters=uncertain.parameters, values=values, curves=curves, limits=result)
    return Spread(
        uncertain=uncertain,
        draws=draws,
        sampled=sampled,
        sensitivities=sensitivities,
        quantities=list_quantities(sampled, sensitivities, uncertain.deviation),
        bands=make_curve_bands(sampled, sensitivities, uncertain.deviation),
    )


def _check_number(opened: OpenCase, draws: int, d: int) -> None:
    if draws < 0 or draws == 1 or draws & (draws - 1):
        raise refuse(
            opened, "draws", f"draws = {draws}: a Sobol sequence needs a power of two: give 0 or 2, 4, ..., 64, ..."
        )
    if draws * (d + 2) > MOST_POINTS:
        raise refuse(
            opened,
            "draws",
            f"draws = {draws} of {d} parameters need {draws * (d + 2)} points, but at most {MOST_POINTS} are "
            "allowed: give fewer",
        )


def _compute_sensitivities(
    opened: OpenCase, uncertain: Uncertain, model: SolveModel, run: RunContext
) -> tuple[CurveSensitivity, ...]:
    tangents = model_tangents(opened, uncertain, run)
    for parameter, tangent in zip(uncertain.parameters, tangents, strict=True):
        if tangent is None:
            run.warn(
                f"{parameter.name} moves points of joints or sensors, or a base that is shaken: there is no "
                "first-order result, only that of the draws"
            )
    result = []
    for curve in model.curves:
        with run.progress.step(f"derivatives of {curve.label}") as report:
            sizes = model.harmonics, model.n_sample
            branch = run.store.run(response_curve, model.system, curve, *sizes)
            if model.tolerance is not None:
                rows = model.output_rows
                branch = run.store.run(refine_curve, model.system, curve, branch, *sizes, model.tolerance, rows)
            result.append(differentiate_curve(model, curve, branch, tangents, report))
    return tuple(result)

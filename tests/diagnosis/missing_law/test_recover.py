"""Laws that were planted in a chain come back: their place, force and words, and a file with them runs."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from correlation.model import Dof
from diagnosis.candidate.catalogue import list_effects
from diagnosis.candidate.place import ANGULAR
from diagnosis.fit.arrangement import Arrangement
from diagnosis.missing_law.basis import EVEN
from diagnosis.missing_law.curves import LawCurves, compute_curves
from diagnosis.missing_law.description import describe
from diagnosis.missing_law.effect_file import write_effect_file
from diagnosis.missing_law.place_law import MissingLaw
from diagnosis.missing_law.recover import recover_law
from tests.diagnosis.missing_law.chain import CLEARANCE, SECOND, STIFF, arranged

#: Error of a recovered force over the largest one: noise of 0.2 % on stiff structures, and straight pieces at a kink.
CLOSE = 0.1


def odd_error(curves: LawCurves, true: NDArray[np.float64]) -> float:
    """Largest error of the odd part of the spring force over the largest true one."""
    result = (curves.spring.mean - curves.spring.mean[::-1]) / 2
    return float(np.abs(result - true).max() / np.abs(true).max())


def test_the_place_of_a_play_is_the_only_credible_one(recovered_play: MissingLaw) -> None:
    assert recovered_play.credible == ("m1",)
    assert np.isclose(recovered_play.probability.sum(), 1.0)


def test_the_force_of_a_play_comes_back_with_its_clearance(recovered_play: MissingLaw) -> None:
    curves = compute_curves(recovered_play.best)
    u = curves.spring.x
    assert odd_error(curves, STIFF * (u - np.clip(u, -CLEARANCE, CLEARANCE))) < CLOSE
    assert {"hardening", "gap"} <= set(describe(curves).words)


def test_odd_harmonics_do_not_tell_an_even_force(recovered_play: MissingLaw) -> None:
    law = recovered_play.best
    assert not law.posterior.is_seen[EVEN]
    even = law.basis.group == EVEN
    np.testing.assert_array_equal(law.posterior.mean[even], 0.0)
    # Only the prior speaks: its variance is that of the data to round-off.
    np.testing.assert_allclose(np.diag(law.posterior.covariance)[even], law.posterior.size[even] ** 2, rtol=1e-9)
    assert not {"asymmetric", "stop"} & set(describe(compute_curves(law)).words)


def test_a_stop_is_told_from_the_second_harmonic(recovered_stop: MissingLaw) -> None:
    curves = compute_curves(recovered_stop.best)
    true = STIFF * np.maximum(curves.spring.x - CLEARANCE, 0.0)
    assert np.abs(curves.spring.mean - true).max() < CLOSE * true.max()
    assert {"stop", "asymmetric"} <= set(describe(curves).words)


def test_drag_takes_work_with_the_cube_of_the_amplitude(recovered_drag: MissingLaw) -> None:
    curves = compute_curves(recovered_drag.best)
    omega = 2 * np.pi * 12.7  # within 5 % of all resonances
    expected = 8 / 3 * 60.0 * omega**2 * curves.work.x[-1] ** 3
    assert np.isclose(curves.work.mean[-1], expected, rtol=0.2)
    assert "drag" in describe(curves).words


def test_nothing_is_recovered_where_nothing_is_missing() -> None:
    assert recover_law(arranged([], (1,))) is None


def test_a_law_along_a_row_that_does_not_move_is_none(chain_with_play: Arrangement) -> None:
    assert recover_law(chain_with_play, {"nowhere": np.zeros(3)}) is None


def test_the_law_of_an_angle_is_told_in_moments(recovered_play: MissingLaw, recovered_stop: MissingLaw) -> None:
    for result in (recovered_play, recovered_stop):
        law = replace(result.best, units=ANGULAR)
        said = describe(curves := compute_curves(law))
        text = "; ".join(said.sentences)
        assert " rad" in text
        assert " N m" in text
        assert not re.search(r"\d m\b|N/m", text + write_effect_file(law, curves, said))


def test_a_place_that_turns_is_recovered_as_one(chain_with_play: Arrangement) -> None:
    fit = chain_with_play.fit
    turning = replace(fit.model, dofs=tuple(Dof(direction="rz") for _ in fit.model.dofs))
    result = recover_law(replace(chain_with_play, fit=replace(fit, model=turning)), {"m1": SECOND})
    assert result is not None
    assert result.best.units is ANGULAR


def test_the_effect_file_runs_and_lowers_the_misfit(
    recovered_play: MissingLaw, chain_with_play: Arrangement, tmp_path: Path
) -> None:
    law, name = recovered_play.best, 'tip "A" \\N {0}\n"""'
    curves = compute_curves(law)
    file = tmp_path / "recovered.py"
    file.write_text(write_effect_file(replace(law, name=name), curves, describe(curves)), encoding="utf-8")
    fit, train = chain_with_play.fit, chain_with_play.train
    named = replace(fit.model, places={name: law.row})
    effect = list_effects(named, extra=[file], level=1.0).effect(f"recovered law at {name}")
    model = chain_with_play.unknowns([]).compose(law.values)
    before = train.residual(train.predict(model))
    after = train.residual(train.predict(effect.apply(replace(model, places=named.places), [1.0]), fit.prediction))
    assert after @ after < 0.01 * (before @ before)

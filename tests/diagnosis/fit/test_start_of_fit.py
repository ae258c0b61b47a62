"""Where fits with a model error begin: of several minima the more probable one counts."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import diagnosis.fit.model_error_fit
from correlation.noise.error_size import NO_ERROR, ErrorSize
from diagnosis.fit.model_error_fit import fit_from_fit

LEFT = ErrorSize(damping=0.01)


@pytest.mark.parametrize(("by_none", "by_left"), [(100.0, 130.0), (130.0, 100.0)])
def test_a_fit_that_is_decided_by_begins_with_and_without_model_error(
    monkeypatch: pytest.MonkeyPatch, by_none: float, by_left: float
) -> None:
    """The search ends in another minimum from either; each costs its chi^2 here."""
    chi2 = {NO_ERROR: by_none, LEFT: by_left}

    def compare(size: ErrorSize) -> Any:
        return SimpleNamespace(model_error=SimpleNamespace(size=size), log_weight=0.0)

    def calibrate(comparison: Any, *_: object, **__: object) -> Any:
        cost = chi2[comparison.model_error.size]
        return SimpleNamespace(
            unknowns=None, chi2=cost, n_number=1000, values=np.zeros(1), prediction=None, jacobian=None
        )

    for name, stand_in in {
        "allow_model_error": lambda *_: compare(NO_ERROR),
        "update_model_error": lambda *_: compare(LEFT),
        "calibrate": calibrate,
        "recalibrate": calibrate,
        "alternate": lambda comparison, fit: (comparison, fit),
    }.items():
        monkeypatch.setattr(diagnosis.fit.model_error_fit, name, stand_in)
    begin: Any = SimpleNamespace(unknowns=None, values=np.zeros(1), model=None, prediction=None)
    given: Any = None
    comparison, fit = fit_from_fit(given, begin, 1e-3)
    assert fit.chi2 == 100.0
    assert comparison.model_error is not None
    assert chi2[comparison.model_error.size] == 100.0

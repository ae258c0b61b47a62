"""Results turn into tables and labelled arrays that say what they hold, and show themselves so in a notebook."""

import numpy as np
import pytest

import stickslip as ss
from correlation.metric.misfit import Misfit
from correlation.prediction import Points
from diagnosis.decision.verdict import Verdict
from fe.modal import ModeSet
from fe.notebook import Labelled, Tabular
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.limits.result import ResponseLimits
from study.compare.result import ComparisonResult
from study.diagnose.round import Round


def modes() -> ModeSet:
    return ModeSet(angular_frequency=2 * np.pi * np.array([10.0, 20.0]), damping_ratio=np.array([0.01, 0.02]),
                   mode_shapes=np.eye(2))  # fmt: skip


def branch() -> ss.ResponseBranch:
    return ss.ResponseBranch(angular_frequency=np.array([1.0, 2.0]), coefficients=np.ones((2, 3, 1)),
                             residual_norm=np.zeros(2), stop_reason=StopReason.REACHED)  # fmt: skip


def test_modes_are_a_table_numbered_from_one() -> None:
    table = modes().to_pandas()
    assert list(table.index) == [1, 2]
    assert table["frequency [Hz]"].tolist() == pytest.approx([10.0, 20.0])  # 2 pi and back
    assert table["damping ratio [-]"].tolist() == [0.01, 0.02]


def test_a_misfit_is_a_table_of_its_points() -> None:
    points = Points(free=np.array([True]), level=np.array([2.0]), frequency=np.array([50.0]), sensor=np.array(["tip"]),
                    harmonic=np.array([1]))  # fmt: skip
    misfit = Misfit(points=points, motion=np.array([True]), measured=np.array([1 + 1j]), predicted=np.array([2j]),
                    deviation=np.ones(1), standardised=np.array([[3.0, 4.0]]), whitened=np.zeros((1, 2)))  # fmt: skip
    (row,) = misfit.to_pandas().to_dict("records")
    assert (row["level [unit of the drive]"], row["frequency [Hz]"], row["sensor"]) == (2.0, 50.0, "tip")
    assert row["measured [SI]"] == 1 + 1j
    assert row["misfit [standard deviations]"] == pytest.approx(np.sqrt(12.5))  # rms of 3 and 4


@pytest.mark.parametrize(
    "kind", [ModeSet, Misfit, Verdict, ss.ResponseBranch, ResponseLimits, ComparisonResult, Round, ss.ReducedModel]
)
def test_every_result_has_a_table_or_arrays_of_its_own(kind: type) -> None:
    assert ("to_xarray" if issubclass(kind, Labelled) else "to_pandas") in vars(kind)
    assert issubclass(kind, Labelled | Tabular)
    assert hasattr(kind, "_repr_html_")


def test_a_reduced_model_is_a_table_of_what_it_keeps() -> None:
    rom = ss.ReducedModel(
        mass=np.eye(5), damping=np.zeros((5, 5)), stiffness=np.eye(5), boundary_node=np.array([4, 4, 4]),
        boundary_direction=np.array([0, 1, 2]), boundary_sets={"tip": np.array([0, 1, 2]), "push": np.array([1])},
        fixed_interface_frequency=np.array([10.0, 20.0]), recovery=np.eye(5), free=np.arange(5), n_node=5,
    )  # fmt: skip
    table = rom.to_pandas()
    assert table["coordinates [-]"].to_dict() == {"tip": 3, "push": 1, "fixed-interface modes": 2}
    assert table.loc["fixed-interface modes"].tolist()[1:] == [10.0, 20.0]


@pytest.mark.parametrize(("result", "shown"), [(modes(), "damping ratio"), (branch(), "residual_norm")])
def test_a_notebook_shows_it(result: ModeSet | ss.ResponseBranch, shown: str) -> None:
    assert shown in result._repr_html_()

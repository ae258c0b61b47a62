"""The fit of the rig's parameters: its computation of limits travels to the processes of a pool."""

import pickle
from types import SimpleNamespace
from typing import Any

import numpy as np

from casefile.table import load_case
from study.kind.registry import open_case
from study.paper.case import PaperCase
from study.paper.fit import LimitComputation, ParameterScale, Tuning
from study.paper.model import PaperModel
from study.paper.parameters import RigParameters
from study.run_context import silent_run
from study.shipped_cases import PAPER, RIG

START = RigParameters(kt=4e6, kn=8e6, mu=0.6, damping=2e-3)


def test_a_process_receives_the_same_parameters_and_the_same_rig() -> None:
    nothing: Any = None
    campaign: Any = SimpleNamespace(sensors=())
    effort = load_case(PAPER, PaperCase).effort
    model = PaperModel(opened=open_case(RIG), campaign=campaign, run=silent_run(), effort=effort)
    scale = ParameterScale(start=START, tuned={"kt": Tuning(step=1e4, deviation=1e6)})
    sent = LimitComputation(make=model, scale=scale, target=nothing)
    received = pickle.loads(pickle.dumps(sent))
    assert received.scale.compose(np.array([2.0])) == sent.scale.compose(np.array([2.0]))
    assert received.make.inputs.case == model.inputs.case
    assert received.make.opened.kind.table is model.opened.kind.table

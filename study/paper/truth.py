"""The specimen of the virtual tests: drawn from a seed, and read only by the tests and the last comparison."""

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from pipeline.output import replace_file
from study.paper.case import PaperCase
from study.paper.parameters import RigParameters

#: Name of the file next to the campaign.
FILE = "truth.json"
#: Iterations of the paper that a truth may resemble, and their misalignments.
LIKE = (1, 2, 3)


@dataclass(frozen=True, kw_only=True)
class Truth:
    """The specimen.

    Parameters
    ----------
    like
        Iteration of the paper whose kind it is: 1 is symmetric, 2 has shifted dead weights, 3 inclined ones too.
    seed
        Seed of its parameters.
    parameters
        Parameters; the density of the blade gives the frequency below, and is None before it is found.
    free_frequency
        First frequency of the free blade [Hz].
    root_loss
        Loss factor of the springs of the root [-].
    """

    like: int
    seed: int
    parameters: RigParameters
    free_frequency: float
    root_loss: float


def draw_truth(case: PaperCase, seed: int, like: int) -> Truth:
    """A specimen from the intervals of the case.

    Parameters
    ----------
    case
        Case of the replay.
    seed
        Seed of the draw.
    like
        Iteration of the paper whose kind it is, see `Truth`.
    """
    random = np.random.default_rng([seed, like])
    drawn = {name: float(random.uniform(*ends)) for name, ends in case.truth.model_dump().items()}
    frequency, loss = drawn.pop("free_frequency"), drawn.pop("root_loss")
    parameters = RigParameters(**drawn)
    if like < 3:
        parameters = replace(parameters, inclination_left=0.0, inclination_right=0.0)
    if like < 2:
        parameters = replace(parameters, shift_left=0.0, shift_right=0.0)
    return Truth(like=like, seed=seed, parameters=parameters, free_frequency=frequency, root_loss=loss)


def write_truth(truth: Truth, folder: Path) -> None:
    """Write the truth next to its campaign."""
    replace_file(folder / FILE, json.dumps(asdict(truth), indent=2) + "\n")

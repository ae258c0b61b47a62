"""Laws recovered from campaigns of a chain, once per session."""

import pytest

from diagnosis.fit.arrangement import Arrangement
from diagnosis.missing_law.place_law import MissingLaw
from diagnosis.missing_law.recover import recover_law
from reduction.jointed_system import Joint, PiecewiseSpring, QuadraticDamper
from tests.diagnosis.missing_law.chain import CLEARANCE, PLACES, SECOND, STIFF, arranged, play


def _recover(arrangement: Arrangement) -> MissingLaw:
    result = recover_law(arrangement, {"m1": SECOND})
    assert result is not None
    return result


@pytest.fixture(scope="session")
def chain_with_play() -> Arrangement:
    return arranged(play(), (1, 3))


@pytest.fixture(scope="session")
def recovered_play(chain_with_play: Arrangement) -> MissingLaw:
    # Of two of the three places: each takes seconds.
    result = recover_law(chain_with_play, {name: PLACES[name] for name in ("m0", "m1")})
    assert result is not None
    return result


@pytest.fixture(scope="session")
def recovered_drag() -> MissingLaw:
    return _recover(arranged([QuadraticDamper(name="hidden", direction=SECOND, damping=60.0)], (1,)))


@pytest.fixture(scope="session")
def recovered_stop() -> MissingLaw:
    stop: Joint = PiecewiseSpring(name="hidden", direction=SECOND, width=CLEARANCE, stiffness=(0.0, STIFF))
    return _recover(arranged([stop], (1, 2)))

"""Mark of tests that take minutes, and of further cases of tests that run in any case."""

import os

import pytest

slow = pytest.mark.skipif(not os.environ.get("STICKSLIP_SLOW"), reason="takes minutes: set STICKSLIP_SLOW=1 to run it")

"""What holds for all tests: the same drawn examples in every run, and a defined start for those that interrupt."""

import signal
from functools import cache

import pytest
from hypothesis import settings

from geometry.errors import MissingSoftware

# A check that passes here and fails there, by the draw, says nothing about the change at hand.
settings.register_profile("repeatable", derandomize=True)
settings.load_profile("repeatable")

# A shell starts background jobs with Ctrl-C ignored, and every child would inherit that: a run of the tests in the
# background would then wait for interrupts that never arrive. A handler, unlike "ignore", is not inherited.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_configure(config: pytest.Config) -> None:
    """Make the marker of tests that draw known."""
    config.addinivalue_line("markers", "draws: draws pictures off-screen; skipped where this machine cannot")


def pytest_itemcollected(item: pytest.Item) -> None:
    """Skip a test that draws where nothing can be drawn."""
    if item.get_closest_marker("draws") and (reason := drawing_is_impossible()):
        item.add_marker(pytest.mark.skip(reason=reason))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run the examples first: the file that takes longest would leave one of two processes idle at the end."""
    items.sort(key=lambda item: item.path.name != "test_examples.py")


@cache
def drawing_is_impossible() -> str:
    """Why nothing can be drawn; empty if it can."""
    from figure.scene.off_screen import require_egl

    try:
        require_egl()
    except MissingSoftware as reason:
        return str(reason)
    return ""

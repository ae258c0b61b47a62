"""Advice on the next test, kept: strangers whose diagnosis leaves several effects are measured once more as advised.

    python -m benchmarks.next_test --seeds 60:90

Each seed is a stranger (`benchmarks.strangers`). Where its verdict is "several", the advised test that a campaign can
hold is measured on the same specimen by time integration, and all data are diagnosed together; the same is done with a
random test that takes no longer. A verdict is *decided* if one effect is named alone, and *right* if that is a hidden
one, or one that these data cannot tell from it.
"""

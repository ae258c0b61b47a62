"""Value of the advice on the next test: strangers with several possible effects are measured again as advised.

    python -m benchmarks.next_test --seeds 60:90

Each seed is a stranger (`benchmarks.strangers`). Where its verdict is "several", the best advised test that a campaign
can represent is measured on the same specimen by time integration, and all data are diagnosed together. The same is
done with a random test that takes no longer. A verdict is *decided* if it names a single effect, and *right* if this is
a hidden effect or one that these data cannot separate from it.
"""

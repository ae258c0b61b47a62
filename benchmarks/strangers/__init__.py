"""Score of the diagnosis on strangers: random structures and tests for which it was not tuned.

    python -m benchmarks.strangers --seeds 0:20 --output strangers.jsonl

Structure (`structure`), tests (`layout`) and hidden effects (`draw`) are drawn by seed. The specimen (`specimen`) is
measured by time integration (`measure`), and case and campaign are diagnosed as by `stickslip diagnose` (`trial`). The
rules of the score are in `score`. Seeds below 1000 are for development; those from 10000 on are sealed.
"""

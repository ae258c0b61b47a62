"""Is the diagnosis right on structures that nobody has tuned it on? Random ones, measured by time integration.

    python -m benchmarks.strangers --seeds 0:20 --output strangers.jsonl

Structure (`structure`), tests (`layout`) and hidden effects (`draw`) are drawn by seed; the specimen (`specimen`) is
integrated in time (`measure`), and case and campaign are diagnosed as `stickslip diagnose` does it (`trial`). The rules
of the score are in `score`. Seeds below 1000 are for development; those from 10000 on are sealed.
"""

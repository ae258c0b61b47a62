"""Benchmarks are no part of the package: they are imported from the checkout, wherever the package is installed."""

import sys
from pathlib import Path

ROOT = str(Path(__file__).parents[2])
if ROOT not in sys.path:
    sys.path.append(ROOT)

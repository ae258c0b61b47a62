"""A benchmark that is run as a script comes first on the path: its folder must hide no package."""

from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_no_benchmark_has_the_name_of_a_package() -> None:
    packages = {item.parent.name for item in ROOT.glob("*/__init__.py")}
    benchmarks = {item.stem for item in ROOT.glob("benchmarks/*.py")}
    assert {"fe", "reduction", "hbsolve"} <= packages
    assert {"limits", "reduction_race"} <= benchmarks
    assert not packages & benchmarks

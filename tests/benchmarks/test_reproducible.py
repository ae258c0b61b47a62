"""The same numbers on other threads and processors, and a benchmark that would see others."""

import numpy as np
import pytest

from benchmarks.reproducible import compare, difference, list_variants, main
from tests.slow import slow

TABLE = b"curve,frequency [Hz],amplitude [um]\nlevel 1,10,4.0\nlevel 1,11,\n"


def test_a_changed_number_row_or_word_is_a_difference() -> None:
    assert difference(TABLE, TABLE) == 0.0
    # Half of the largest amplitude; the division of decimal fractions rounds once.
    assert difference(TABLE, TABLE.replace(b"4.0", b"6.0")) == pytest.approx(0.5, rel=1e-15)
    assert difference(TABLE, TABLE.replace(b"level 1,10", b"level 2,10")) == np.inf
    assert difference(TABLE, TABLE.replace(b"11,\n", b"11,1\n")) == np.inf
    assert difference(TABLE, TABLE + b"level 1,12,1\n") == np.inf
    # What is left of the balance is round-off, whatever its size.
    assert difference(b"residual norm\n1e-12\n", b"residual norm\n3e-12\n") == pytest.approx(2e-12, rel=1e-9)


def test_threads_may_change_no_byte_and_processors_no_more_than_round_off() -> None:
    one, two, old, _ = list_variants(machine_code=True)
    assert one.environment == {}
    first = {"a.csv": TABLE}
    near = {"a.csv": TABLE.replace(b"4.0", b"4.000000001")}
    far = {"a.csv": TABLE.replace(b"4.0", b"4.00001")}
    assert [compare(two, first, files).is_right for files in (first, near, far)] == [True, False, False]
    assert [compare(old, first, files).is_right for files in (first, near, far)] == [True, True, False]


@slow
def test_the_shipped_chain_has_the_same_numbers_on_other_threads_and_processors() -> None:
    assert main([]) == 0

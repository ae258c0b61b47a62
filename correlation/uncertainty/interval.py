"""The interval that is printed with every number."""

from scipy.special import ndtr, stdtrit

#: Number of standard deviations on either side of the mean that cover 95 % of a normal distribution [-].
TWO_SIDED_95 = 1.96


def compute_student_factor(freedom: int) -> float:
    """Factor on `TWO_SIDED_95` if the standard deviation is estimated with so many degrees of freedom [-]."""
    return float(stdtrit(freedom, ndtr(TWO_SIDED_95))) / TWO_SIDED_95

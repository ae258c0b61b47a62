"""The interval that is printed beside every number."""

#: Standard deviations on either side of the mean that hold 95 % of a normal distribution [-].
TWO_SIDED_95 = 1.96

"""The interval that is printed with every number."""

#: Number of standard deviations on either side of the mean that cover 95 % of a normal distribution [-].
TWO_SIDED_95 = 1.96

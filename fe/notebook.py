"""Display of results in a notebook, as a table or as labelled arrays.

pandas and xarray are imported when they are used.
"""

from abc import abstractmethod
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas
    import xarray


class Tabular:
    """Base of results with one row per item."""

    @abstractmethod
    def to_pandas(self) -> "pandas.DataFrame":
        """Table of the result; units are in the names of the columns."""

    def _repr_html_(self) -> str:
        return str(self.to_pandas()._repr_html_())


class Labelled:
    """Base of results of arrays over common dimensions."""

    @abstractmethod
    def to_xarray(self) -> "xarray.Dataset":
        """Labelled data set of the result; units are attributes."""

    def _repr_html_(self) -> str:
        return str(self.to_xarray()._repr_html_())

"""Units of a universal file: dataset 164, and the units of its data types."""

from dataclasses import dataclass

from correlation.file.number import read_numbers
from correlation.file.uff.dataset import Dataset
from correlation.file.uff.record import read_fields

#: Units of length and force by units code.
CODES = {
    1: ("m", "N"), 2: ("ft", "lbf"), 3: ("m", "kgf"), 4: ("ft", "poundal"), 5: ("mm", "mN"), 6: ("cm", "cN"),
    7: ("inch", "lbf"), 8: ("mm", "kgf"), 10: ("mm", "N"),
}  # fmt: skip
#: Number of units per metre or newton; values in a file are divided by this factor.
LENGTHS = {"m": 1.0, "mm": 1000.0, "cm": 100.0, "um": 1e6, "ft": 1 / 0.3048, "inch": 1 / 0.0254}
FORCES = {
    "N": 1.0, "mN": 1000.0, "cN": 100.0, "kN": 1e-3, "lbf": 1 / 4.4482216152605, "kgf": 1 / 9.80665,
    "poundal": 1 / 0.138254954376,
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class FileUnits:
    """Units of a file.

    Parameters
    ----------
    length, force
        Units as text; empty if they are unknown.
    metre
        Length of its unit [m].
    described
        Description of the units from the file.
    """

    length: str = ""
    force: str = ""
    metre: float = 1.0
    described: str = ""

    def of_type(self, data_type: int) -> str:
        """Unit of a data type, such as 12 for acceleration; empty if it is unknown."""
        if data_type in {17, 18, 19}:
            return {17: "s", 18: "Hz", 19: "rpm"}[data_type]
        if data_type in {9, 13}:
            return self.force
        if data_type in {8, 11, 12} and self.length:
            return self.length + {8: "", 11: "/s", 12: "/s^2"}[data_type]
        if data_type in {2, 15} and self.length and self.force:
            return f"{self.force}/{self.length}^2"
        return ""


def read_units(dataset: Dataset) -> FileUnits:
    """Read the units of dataset 164.

    Raises
    ------
    CampaignError
        A field is not a number, or a factor is not positive.
    """
    code, description, _ = read_fields(dataset, 0, (10, 20, 10), "iti")
    dataset.text(1)
    dataset.require_at_most(3)
    factors = read_numbers(b" ".join(dataset.lines[1:3]))
    if factors is None or len(factors) < 2:
        raise dataset.error(1, "needs the factors of length, force and temperature; export the file again")
    length, force = float(factors[0]), float(factors[1])
    if not (0 < length < 1e30 and 0 < force < 1e30):
        raise dataset.error(1, f"the factors of length {length:g} and force {force:g} must be positive")
    # Factors have priority over the code: programs write code 5 (mm, mN) for mm and N.
    named = CODES.get(int(code), ("", ""))
    return FileUnits(
        length=_find_closest(LENGTHS, length, named[0]),
        force=_find_closest(FORCES, force, named[1]),
        metre=1.0 / length,
        described=f"{str(description).strip()} (code {code}: 1 m is {length:.10g}, 1 N is {force:.10g} units)".strip(),
    )


def _find_closest(factors: dict[str, float], factor: float, named: str) -> str:
    """Unit with a factor, preferably that of the code; empty if there is none."""
    names = [name for name, value in factors.items() if abs(value / factor - 1) < 1e-4]
    return named if named in names else next(iter(names), "")

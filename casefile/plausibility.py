"""Whether a value can be what its key means: a slip of a unit is refused, or found unusual, with the likely unit."""

from collections.abc import Sequence
from dataclasses import dataclass

from correlation.campaign.measurement_unit import NUMBER_AND_UNIT, find_si_factor


@dataclass(frozen=True, kw_only=True)
class Plausibility:
    """Ranges of a quantity in its place.

    Parameters
    ----------
    si
        SI unit of the ranges.
    possible
        Least and greatest value of a solid [`si`]; beyond them a value is refused.
    usual, usual_of
        Least and greatest value of some materials [`si`], and these in words; beyond them a value is used, with a
        warning.
    unit
        Unit of the numbers in messages.
    confused
        Units that are written for each other, the likeliest first.
    """

    si: str
    possible: tuple[float, float]
    usual: tuple[float, float]
    usual_of: str
    unit: str
    confused: Sequence[str]

    def refusal(self, value: float, text: object) -> str:
        """Reason why no solid has such a value; empty if it is possible.

        Parameters
        ----------
        value
            Positive [`si`]; others are refused by those who compute with them.
        text
            The value as it was written.
        """
        if value <= 0 or self.possible[0] <= value <= self.possible[1]:
            return ""
        return f"{self._number(value)} {self.unit} is beyond any solid ({self._range(self.possible)})" + (
            self._likely(value, text) or "; check its number and its unit"
        )

    def doubt(self, value: float, text: object) -> str:
        """Warning about a possible but unusual value; empty for usual ones."""
        if value <= 0 or self.usual[0] <= value <= self.usual[1]:
            return ""
        return (
            f"{self._number(value)} {self.unit} is used, but {self.usual_of} have {self._range(self.usual)}"
            + self._likely(value, text)
        )

    def _number(self, value: float) -> str:
        return f"{value / find_si_factor(self.unit, self.si):,.6g}"

    def _range(self, ends: tuple[float, float]) -> str:
        return f"{self._number(ends[0])} to {self._number(ends[1])} {self.unit}"

    def _likely(self, value: float, text: object) -> str:
        """Question whether another unit is meant, with which the number is usual."""
        written = NUMBER_AND_UNIT.fullmatch(text) if isinstance(text, str) else None
        if written is None:
            return ""
        one = value / float(written[1])
        for unit in self.confused:
            if self.usual[0] <= value * find_si_factor(unit, self.si) / one <= self.usual[1]:
                return f'; did you mean "{written[1]} {unit}"?'
        return ""


#: Least: soft foams. Greatest: diamond, 1.22 TPa along <111> (McSkimin and Andreatch, J. Appl. Phys. 43, 1972).
#: Metals: lead, 16 GPa; iridium, 528 GPa (Ashby, Materials Selection in Mechanical Design, appendix A).
YOUNGS_MODULUS = Plausibility(
    si="Pa",
    possible=(1e3, 1.3e12),
    usual=(10e9, 600e9),
    usual_of="metals",
    unit="GPa",
    confused=("GPa", "MPa", "Pa", "psi"),
)
#: Least: aerogels. Greatest: osmium, 22,590 kg/m^3 (Arblaster, Platinum Metals Rev. 57, 2013).
#: Metals: magnesium, 1738 kg/m^3, to osmium.
MATERIAL_DENSITY = Plausibility(
    si="kg/m^3",
    possible=(0.1, 25e3),
    usual=(1.5e3, 23e3),
    usual_of="metals",
    unit="kg/m^3",
    confused=("kg/m^3", "g/cm^3", "tonne/mm^3"),
)
#: A chip of a resonator, and a blade of a wind turbine with its hub. Longer and shorter bodies vibrate as well, but a
#: mesh in millimetres that is read in metres, or the other way round, lies beyond.
BODY_SIZE = Plausibility(
    si="m",
    possible=(0.0, float("inf")),
    usual=(5e-4, 30.0),
    usual_of="structures that are shaken",
    unit="m",
    confused=("m", "mm", "um", "inch"),
)
#: From a long bridge to a resonator of half a millimetre.
FIRST_FREQUENCY = Plausibility(
    si="Hz",
    possible=(0.0, float("inf")),
    usual=(0.05, 1e7),
    usual_of="structures that are shaken",
    unit="Hz",
    confused=(),
)

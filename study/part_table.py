"""Tables of a reduced part, as CSV: frequencies, and stations with their frames."""

from collections.abc import Mapping

from geometry.interface import ContactLine
from study.compared_reduction import ComparedReduction


def frequency_table(found: ComparedReduction) -> str:
    """Full and reduced frequencies [Hz], and the estimated truncation error [-]."""
    lines = [
        f"{number},{full:.9g},{rom:.9g},{error:.3g}"
        for number, (full, rom, error) in enumerate(
            zip(found.frequency, found.rom_frequency, found.rom_error, strict=True), start=1
        )
    ]
    return "\n".join(["mode,full_hz,reduced_hz,estimated_error", *lines, ""])


def station_table(lines: Mapping[str, ContactLine]) -> str:
    """Place, normal out of the body, tangents along and across, and tributary length of each station [m, -]."""
    axes = "xyz"
    head = ["name", "station", *axes]
    head += [f"{vector}_{axis}" for vector in ("normal", "along", "across") for axis in axes]
    rows = [",".join([*head, "length"])]
    for name, line in lines.items():
        for k in range(line.n_station):
            values = [*line.stations[k], *line.normal[k], *line.tangents[k].ravel(), line.tributary_length[k]]
            # Adding nothing makes a negative zero a plain one.
            rows.append(",".join([f'"{name}"', str(k), *(f"{value + 0.0:.12g}" for value in values)]))
    return "\n".join([*rows, ""])

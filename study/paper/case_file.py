"""Parameters written into the text of a case of a rig; comments and layout stay."""

from collections.abc import Mapping
from math import degrees
from typing import Any

from geometry.rig import SIDES
from study.paper.parameters import RigParameters


def write_parameters(
    text: str, parameters: RigParameters, ratio: float, others: Mapping[tuple[str, ...], Any] | None = None
) -> str:
    """The text of a case with other parameters.

    Parameters
    ----------
    text
        Text of a case file of kind "rig".
    parameters
        New parameters.
    ratio
        Damping ratio of the case [-]; the ratio of the parameters is that of the stuck peak.
    others
        Further values of [structure], by the names of their tables and key.
    """
    own = parameters
    values: dict[tuple[str, ...], Any] = {
        ("contact", "kt"): f"{own.kt:.7g} N/m",
        ("contact", "kn"): f"{own.kn:.7g} N/m",
        ("contact", "mu"): float(f"{own.mu:.6g}"),
        ("damping", "ratio"): f"{100 * ratio:.6g} %",
    }
    if own.root is not None:
        values["root", "stiffness"] = f"{own.root:.7g} N/m"
    if own.density is not None:
        values["blade_material", "density"] = f"{own.density:.7g} kg/m^3"
    for side in SIDES:
        shift, inclination = (getattr(own, f"{name}_{side}") for name in ("shift", "inclination"))
        values["dead_weight", side, "shift"] = f"{1e3 * shift:.6g} mm" if shift else None
        values["dead_weight", side, "inclination"] = f"{degrees(inclination):.6g} deg" if inclination else None
    values["contact", "left_blade", "gap_angle"] = f"{degrees(own.gap_angle):.6g} deg" if own.gap_angle else None
    return write_values(text, values | dict(others or {}))


def write_values(text: str, values: Mapping[tuple[str, ...], Any]) -> str:
    """The text of a case with values in its [structure], by the names of their tables and key; None removes a key.

    New tables come at the end: in the middle they would separate a table from the comment above it.
    """
    import tomlkit

    document: Any = tomlkit.parse(text)
    new: dict[str, list[str]] = {}
    for (*tables, key), value in values.items():
        table = document["structure"]
        for name in tables:
            table = table.get(name) if table is not None else None
        if table is None:
            if value is not None:
                new.setdefault(".".join(["structure", *tables]), []).append(
                    f"{key} = {tomlkit.item(value).as_string()}"
                )
        elif value is not None:
            table[key] = value
        elif key in table:
            del table[key]
    ends = [f"[{name}]\n" + "\n".join(lines) + "\n" for name, lines in new.items()]
    return "\n".join([tomlkit.dumps(document).rstrip() + "\n", *ends])

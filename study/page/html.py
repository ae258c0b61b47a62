"""HTML of a page from its template, with style, plotly.js and data in one file."""

import importlib.metadata
import json
import re
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from study.json_value import plain

STYLE = Path(__file__).with_name("style.css")
COMMON = Path(__file__).with_name("common.js")


def render_page(
    template: Path, script: Path, data: Mapping[str, Any], filters: Mapping[str, Callable[..., Any]], **values: Any
) -> str:
    """One self-contained page.

    Parameters
    ----------
    template
        Jinja template with the places `style`, `plotly`, `data` and `script`.
    script
        JavaScript that draws the constant `DATA`.
    data
        `DATA`; numbers that are not finite become null.
    filters
        Of the template, beside `typeset`.
    values
        Other values of the template.
    """
    from jinja2 import Environment, StrictUndefined

    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters |= {"typeset": set_in_type, **filters}
    return environment.from_string(template.read_text(encoding="utf-8")).render(
        version=importlib.metadata.version("stickslip"),
        style=STYLE.read_text(encoding="utf-8"),
        plotly=_script_safe(_read_plotly()),
        data=_script_safe(json.dumps(plain(data), ensure_ascii=False, separators=(",", ":"))),
        script=COMMON.read_text(encoding="utf-8") + script.read_text(encoding="utf-8"),
        **values,
    )


def set_in_type(text: str) -> str:
    """Words as they are printed: ± for +-, χ² for chi^2, µm for um, raised exponents."""
    text = text.replace("+-", "±").replace("chi^2", "χ²").replace("^2", "²").replace("^3", "³")
    return re.sub(r"\bum\b", "µm", text).replace(" %", "\u00a0%")


def _read_plotly() -> str:
    """plotly.js, without plotly's Python, which takes a third of a second to import."""
    package = find_spec("plotly")
    assert package is not None
    assert package.origin is not None
    return (Path(package.origin).parent / "package_data" / "plotly.min.js").read_text(encoding="utf-8")


def _script_safe(text: str) -> str:
    """Text that cannot end the script element that it stands in."""
    return text.replace("</script", "<\\/script").replace("<!--", "<\\!--")

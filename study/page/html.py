"""HTML of a page from its template, with style, plotly.js and data in one file."""

import base64
import hashlib
import importlib.metadata
import json
import re
from collections.abc import Callable, Iterable, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from figure.style import typeset
from study.json_value import to_json
from study.run_record import get_provenance

STYLE = Path(__file__).with_name("style.css")
#: Scripts of all pages; the bench also uses the first.
LOG_SCALE, COMMON, BAND_AXES = (
    Path(__file__).with_name(name) for name in ("log_scale.js", "common.js", "band_axes.js")
)


def render_page(
    template: Path, script: Path, data: Mapping[str, Any], filters: Mapping[str, Callable[..., Any]], **values: Any
) -> str:
    """Render a self-contained page with plotly.js, data and scripts.

    Parameters
    ----------
    template
        Jinja template with the variables `style`, `plotly`, `data` and `script`.
    script
        JavaScript file that draws the constant `DATA`.
    data
        Content of `DATA`; numbers that are not finite become null.
    filters
        Filters of the template, in addition to `typeset`.
    values
        Other values of the template.
    """
    content = _remove_tags(json.dumps(to_json(data), ensure_ascii=False, separators=(",", ":")))
    content = content.replace("<", "\\u003c")  # "<" could end the script element
    scripts = {
        "plotly": _escape_script(_read_plotly()),
        "data": f"const DATA = {content};",
        "script": "".join(file.read_text(encoding="utf-8") for file in (LOG_SCALE, COMMON, BAND_AXES, script)),
    }
    return fill_template(template, scripts, filters, **values)


def fill_template(
    template: Path, scripts: Mapping[str, str], filters: Mapping[str, Callable[..., Any]], **values: Any
) -> str:
    """Render a page with style, content policy, provenance and version.

    Parameters
    ----------
    template
        Jinja template.
    scripts
        Complete texts of its script elements, by their variables in the template.
    filters
        Filters of the template, in addition to `typeset`.
    values
        Other values of the template.
    """
    from jinja2 import Environment, StrictUndefined

    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters |= {"typeset": typeset_text, **filters}
    return environment.from_string(template.read_text(encoding="utf-8")).render(
        version=importlib.metadata.version("stickslip"),
        policy=make_content_policy(scripts.values()),
        provenance=format_provenance(),
        style=STYLE.read_text(encoding="utf-8"),
        **scripts,
        **values,
    )


def format_provenance() -> str:
    """Provenance of a page as JSON; empty for a page made from Python, outside a recorded run."""
    made_by = get_provenance()
    return "" if made_by is None else made_by.as_json()


def make_content_policy(scripts: Iterable[str] = ()) -> str:
    """Content security policy of a page: it allows only these scripts and embedded pictures, and no network access.

    Parameters
    ----------
    scripts
        Complete texts of the script elements of the page.

    References
    ----------
    Content Security Policy Level 3, W3C Working Draft: hashes of inline scripts.
    """
    hashes = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii") for text in scripts]
    allowed = " ".join(f"'sha256-{item}'" for item in hashes) or "'none'"
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data: blob:; font-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def embed(picture: bytes) -> str:
    """Data URL of a PNG picture or a GIF film, for the source of an image element."""
    kind = "gif" if picture.startswith(b"GIF8") else "png"
    return f"data:image/{kind};base64,{base64.b64encode(picture).decode()}"


def typeset_text(text: str) -> str:
    """Typeset text, with a no-break space before %."""
    return typeset(text).replace(" %", "\u00a0%")


def _read_plotly() -> str:
    """Text of plotly.js, read without importing the plotly package, which takes a third of a second."""
    package = find_spec("plotly")
    assert package is not None
    assert package.origin is not None
    return (Path(package.origin).parent / "package_data" / "plotly.min.js").read_text(encoding="utf-8")


def _escape_script(text: str) -> str:
    """Escape JavaScript so that it cannot end its script element."""
    return re.sub(r"<(/script|!--)", r"<\\\1", text, flags=re.IGNORECASE).replace("\r\n", "\n")


def _remove_tags(text: str) -> str:
    """JSON without HTML tags: names come from files, and plotly.js would interpret tags in them."""
    return re.sub(r"<(?=[A-Za-z/!])", "\u2039", text)

"""Pages show names from files as text, run no script but their own, and load and send nothing; a browser agrees."""

import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest

from study.page.html import make_content_policy, render_page

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
#: What a hostile file may call a sensor, an effect or itself.
HOSTILE = (
    "</script><script>hack()</script>",
    "</ScRiPt ><img src=x onerror=hack()>",
    '"><svg onload=hack()>',
    "<!--<script>",
    '<a href="javascript:hack()">tip</a>',
    "{{ 7 * 7 }} %{x}",
    "\u2028tip\u2029",
)
TEMPLATE = """\
<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{{ policy }}"><title>{{ title }}</title>
<style>{{ style | safe }}</style></head>
<body title="{{ title }}"><p id="names">{% for name in names %}{{ name | typeset }} {% endfor %}</p>
<div id="plot" class="plot"></div>{{ injected | safe }}
<script>{% autoescape false %}{{ plotly }}{% endautoescape %}</script>
<script>{{ data | safe }}</script>
<script>{{ script | safe }}</script>
</body></html>
"""
SCRIPT = """
byId("plot").dataset.names = DATA.names.length;
drawPlot("plot", { data: [{ type: "bar", x: DATA.names, y: DATA.names.map((_, k) => k + 1), name: DATA.names[0] }],
  layout: { title: { text: DATA.names.join(" ") }, height: 400, showlegend: true } });
document.body.dataset.drawn = "yes";
"""
#: An element that would run a script if the policy let it.
INJECTED = (
    "<script>document.body.dataset.hacked = 'script'</script><img src=x onerror=\"document.body.dataset.hacked=1\">"
)


def rendered(folder: Path, injected: str = "") -> str:
    (folder / "page.html.j2").write_text(TEMPLATE)
    (folder / "page.js").write_text(SCRIPT)
    return render_page(
        folder / "page.html.j2", folder / "page.js", {"names": list(HOSTILE)}, {}, title=HOSTILE[0], names=HOSTILE,
        injected=injected,
    )  # fmt: skip


def browsed(page: Path) -> str:
    """The page as a browser leaves it when its scripts have run."""
    with tempfile.TemporaryDirectory(dir="/tmp") as profile:
        done = subprocess.run(
            [
                str(CHROMIUM), "--headless=new", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=8000",
                f"--user-data-dir={profile}", "--host-resolver-rules=MAP * ~NOTFOUND", "--dump-dom", page.as_uri(),
            ],
            capture_output=True, text=True, timeout=120, check=False, env={**os.environ, "TMPDIR": profile},
        )  # fmt: skip
    assert done.returncode == 0, done.stderr[-1000:]
    return done.stdout


def test_a_name_cannot_leave_the_script_or_the_text_that_it_stands_in(tmp_path: Path) -> None:
    text = rendered(tmp_path)
    data = re.search(r"<script>const DATA = .*?</script>", text, re.DOTALL)
    assert data is not None
    assert data[0].count("<") == 2  # those of the element itself
    outside = re.sub(r"<script>.*?</script>", "", text, flags=re.DOTALL)
    assert not re.search(r"<(img|svg|a )", outside)
    assert "hack()" in outside  # as text


def test_a_policy_without_scripts_allows_none() -> None:
    assert "script-src 'none'" in make_content_policy()
    assert "unsafe-inline' " not in make_content_policy(["let a = 1;"]).partition("style-src")[0]
    # The hash of "alert('Hello, world.');" in the standard's own example (CSP 3, section 8.3).
    assert "'sha256-qznLcsROx4GACP2dm0UCKCzCG+HiZ1guq6ZZDob/Tng='" in make_content_policy(["alert('Hello, world.');"])


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium here (apt-get install chromium)")
def test_a_browser_draws_hostile_names_and_runs_no_script_but_the_page_s_own(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    page.write_text(rendered(tmp_path, INJECTED), encoding="utf-8")
    seen = browsed(page)
    assert 'data-drawn="yes"' in seen
    assert f'data-names="{len(HOSTILE)}"' in seen
    assert "main-svg" in seen
    assert "data-hacked" not in re.sub(r"<script.*?</script>|onerror=\"[^\"]*\"", "", seen, flags=re.DOTALL)
    drawn = re.sub(r"<script.*?</script>", "", seen, flags=re.DOTALL)
    assert not re.search(r"<a [^>]*(xlink:)?href=", drawn)
    assert "javascript:hack()" in drawn  # as text


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium here (apt-get install chromium)")
def test_the_policy_is_what_stops_an_injected_script(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    page.write_text(re.sub(r"<meta http-equiv[^>]*>", "", rendered(tmp_path, INJECTED)), encoding="utf-8")
    assert 'data-hacked="1"' in browsed(page)

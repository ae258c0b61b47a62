"""Matplotlib without its help draws as it does with it."""

import subprocess
import sys

SCRIPT = """
import hashlib, sys
if "quickly" in sys.argv:
    from figure.matplotlib_import import import_matplotlib
    import_matplotlib()
from figure.style import add_heading, new_figure, png, Headed
figure = new_figure(2.0, 2.0)
axes = figure.subplots()
axes.plot([0, 1], [1, 0]), axes.set(title="a title", xlim=(-1, 2))
try:
    axes.set(no_such="property")
except AttributeError:
    add_heading(figure, Headed(title="refused"))
print(len(axes.set.__doc__ or ""), hashlib.sha256(png(figure)).hexdigest())
from matplotlib.artist import Artist
class Own(Artist):
    '''Of a user, who may read its help.'''
print(len(Own.set.__doc__))
"""


def drawn(*words: str) -> list[str]:
    done = subprocess.run([sys.executable, "-c", SCRIPT, *words], capture_output=True, text=True, check=True)
    return done.stdout.split()


def test_figures_are_the_same_without_the_help_of_matplotlibs_own_classes() -> None:
    usual, quick = drawn(), drawn("quickly")
    assert quick[1:] == usual[1:]
    assert int(quick[0]) < int(usual[0])

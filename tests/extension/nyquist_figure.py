"""A figure from outside: response curves in the complex plane, where a resonance is a circle."""

from matplotlib.figure import Figure

from figure.registry import REGISTRY, FigureKind
from figure.response_curves import ResponseCurves
from figure.style import add_title, choose_family_colours, open_box


def nyquist_figure(of: ResponseCurves) -> Figure:
    """Draw the imaginary part over the real part."""
    figure = Figure(figsize=(6, 6), layout="constrained")
    axes = figure.subplots()
    for curve, colour in zip(of.curves, choose_family_colours(len(of.curves)), strict=True):
        axes.plot(curve.response.real, curve.response.imag, color=colour, label=curve.label)
    unit = of.amplitude_label.partition("[")[2]
    axes.set_xlabel(f"real part [{unit}")
    axes.set_ylabel(f"imaginary part [{unit}")
    axes.set_aspect("equal", adjustable="datalim")
    open_box(axes)
    figure.legend(loc="outside lower center", ncols=len(of.curves), frameon=False)
    add_title(figure, of.title)
    return figure


REGISTRY.register(FigureKind(name="nyquist", draws=ResponseCurves, draw=nyquist_figure))

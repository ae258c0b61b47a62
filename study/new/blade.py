"""A first case of a blade, from its dimensions."""

from study.new.draft import REDUCTION, STEEL, CaseDraft, NewCaseRequest, key
from study.run_context import RunContext

DIMENSIONS = (
    ("length", "Length of the blade, from its root block to the tip?", "200 mm"),
    ("thickness", "Thickness, in the direction of vibration?", "8 mm"),
    ("chord", "Width?", "30 mm"),
)
WHY = "the first frequency grows with thickness / length^2"


def draft_blade(request: NewCaseRequest, run: RunContext) -> CaseDraft:
    """Draft a uniform blade on a root block, clamped at two sides of the block."""
    del run
    answers = {name: request.value(name, question, default, WHY) for name, question, default in DIMENSIONS}
    length, thickness = (request.millimetres(name, answers[name]) for name in ("length", "thickness"))
    lines = "\n".join(key(name, answer) for name, answer in answers.items())
    text = f"""\
[structure]
kind = "blade"

# A uniform bar on a root block, of which two faces are clamped. kind = "rig" is the blade of the paper, with pads and
# grooves for dampers; docs/blade.md has the dimensions of both.
[structure.blade]
kind = "plain"
{lines}
root_chord = "{request.millimetres("chord", answers["chord"]):g} mm" # the block is as wide as the blade
root_thickness = "{2 * thickness:g} mm"
root_height = "{2 * thickness:g} mm"
excitation_height = "{length / 10:g} mm" # where the force acts, above the block

{STEEL}
[structure.mesh]
element = "hex20"
elements_through_thickness = 2
length_ratio = 2.3 # greatest length of an element over its thickness
length_cap = "{min(8.0, length / 20):g} mm"

{REDUCTION.format(modes=30)}"""
    return CaseDraft(text=text)

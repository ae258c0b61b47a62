"""A first case of the rig: the shipped one, with larger elements and one friction history."""

from study.new.draft import CaseDraft, NewCaseRequest
from study.run_context import RunContext
from study.shipped_cases import RIG

#: Changes that shorten the first run to about a minute.
COARSER = (('size = "2.5 mm"', 'size = "5 mm"'), ("modes = 150", "modes = 60"), ("histories = 3", "histories = 1"))


def draft_rig(request: NewCaseRequest, run: RunContext) -> CaseDraft:
    """Draft the rig of the paper: a blade, two dampers and two de-couplers."""
    del request, run
    text = RIG.read_text(encoding="utf-8")
    for fine, coarse in COARSER:
        assert fine in text
        text = text.replace(fine, f"{coarse} # {fine.rpartition(' = ')[2]} in study/cases/rig.toml", 1)
    return CaseDraft(text=text[text.index("[structure]") :], is_whole=True)

"""Sections of the page of a comparison, one file each.

A section is a title, sentences, and drawings below them. A function of a comparison returns the sections that have
data, so that no empty section is shown::

    def loop_sections(compared: ComparisonResult) -> Iterator[Section]:
        if compared.loops:
            yield Section(title="Hysteresis loops", text="...", pictures={"loops, 5 N": png})

`ComparisonResult.sections` contains the sections of further results of a command, such as families over limits.
"""

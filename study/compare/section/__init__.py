"""Sections of the page of a comparison: one file each, in the order in which they are read.

A section is a title, sentences, and what is drawn below them. A function of a comparison returns those for which there
is data, so that nothing empty is shown::

    def loop_sections(compared: ComparisonResult) -> Iterator[Section]:
        if compared.loops:
            yield Section(title="Hysteresis loops", text="...", pictures={"loops, 5 N": png})

`ComparisonResult.sections` holds those of what a command does besides, such as families over limits.
"""

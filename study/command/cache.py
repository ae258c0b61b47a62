"""``stickslip cache``: show the size of the stored results, or remove them."""

from typing import Annotated

from cyclopts import Parameter

from study.run_context import DEFAULTS, Answer, Options, make_command_app

app = make_command_app(
    "cache",
    "Every finished stage of a computation is stored, so that a second run is instant and an interrupted one "
    "continues. Removing them costs only time.",
    examples=["stickslip cache", "stickslip cache --clear", "stickslip cache --cache /scratch/results --json"],
)


@app.default
def cache(
    *,
    clear: Annotated[bool, Parameter(negative="", help="Remove all stored results.")] = False,
    options: Options = DEFAULTS,
) -> Answer:
    """Show or clear the cache."""
    from geometry.errors import OutputError

    folder = options.cache_folder
    store = options.open().store
    if store.folder is None:
        raise OutputError(f"cannot write to the cache {folder}: name another folder with --cache")
    count, size = store.size()
    document = {"folder": str(folder), "results": count, "bytes": size, "cleared": clear}
    if clear:
        store.clear()
        return Answer(document=document, text=f"removed {count} results ({format_size(size)}) from {folder}")
    return Answer(document=document, text=f"{count} results, {format_size(size)}, in {folder}")


def format_size(size: int) -> str:
    """Format a size in decimal units: ``12.3 MB``."""
    amount = float(size)
    for unit in ("bytes", "kB", "MB"):
        if amount < 1000:
            return f"{amount:.3g} {unit}"
        amount /= 1000
    return f"{amount:.3g} GB"

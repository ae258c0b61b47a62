"""Files of a campaign: names in a manifest lead to ordinary files in the folder of the campaign, and nowhere else."""

from pathlib import Path

from correlation.errors import CampaignError


def find_file(folder: Path, name: str) -> Path:
    """The file of a name, which may have folders within that of the campaign.

    Raises
    ------
    CampaignError
        There is none, it lies outside, by a link too, or it is no ordinary file.
    """
    path = folder / name
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
        is_there, is_file = path.exists(), path.is_file()
    except (OSError, RuntimeError, ValueError):  # a name too long, a circle of links, a zero in the name
        raise CampaignError(f"{name!r} is not a file name: correct it in the manifest") from None
    if not inside:
        raise CampaignError(f'{name}: lies outside the folder "{folder}" of the campaign: copy it there')
    if not is_there:
        raise CampaignError(f'{name}: there is no such file in "{folder}"; correct its name in the manifest')
    if not is_file:
        raise CampaignError(f"{name}: is a folder or a device; give one file")
    return path

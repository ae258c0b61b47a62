"""Paths of the files of a campaign: only ordinary files in the folder of the campaign are accepted."""

from pathlib import Path

from correlation.errors import CampaignError


def find_file(folder: Path, name: str) -> Path:
    """Path of a file that the manifest names, possibly in a subfolder of the campaign.

    Raises
    ------
    CampaignError
        The file does not exist, lies outside the folder (also by a link), or is not an ordinary file.
    """
    path = folder / name
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
        is_there, is_file = path.exists(), path.is_file()
    except (OSError, RuntimeError, ValueError):  # too long a name, a loop of links, a null byte in the name
        raise CampaignError(f"{name!r} is not a file name: correct it in the manifest") from None
    if not inside:
        raise CampaignError(f'{name}: lies outside the folder "{folder}" of the campaign: copy it there')
    if not is_there:
        raise CampaignError(f'{name}: there is no such file in "{folder}"; correct its name in the manifest')
    if not is_file:
        raise CampaignError(f"{name}: is a folder or a device; give one file")
    return path

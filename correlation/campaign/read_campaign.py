"""Read a campaign, whatever its format."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from correlation.campaign.format import FORMATS, CampaignFormat
from correlation.campaign.format.toml_folder import check_folder, read_folder
from correlation.campaign.measured_files import MeasuredFiles
from correlation.campaign.measurement import SWEEPS, Campaign
from correlation.campaign.stepped_sine import find_sorting
from correlation.data_quality.campaign import find_suspicions
from correlation.data_type.registry import Analyse, analyse_uncached
from correlation.errors import CampaignError


def read_campaign(path: Path, analyse: Analyse = analyse_uncached) -> Campaign:
    """Read a campaign in any of `FORMATS`.

    Parameters
    ----------
    path
        Folder with ``campaign.toml`` (``docs/campaign.md``), or a path of another format.
    analyse
        Calls a slow function of a module with its arguments, or returns an earlier result for the same arguments; by
        default no results are kept.

    Returns
    -------
    Campaign in SI, peak amplitudes, e^{+i k Omega t}, rows sorted; its ``suspicions`` list probable mistakes.

    Raises
    ------
    CampaignError
        One sentence with file, line or key, value and remedy; independent mistakes are listed one per line.
    """
    path = Path(path)
    result = [item for item in FORMATS if item.recognise(path)]
    if len(result) > 1:
        names = " and ".join(f'"{item.name}"' for item in result)
        raise CampaignError(f'"{path}" is a campaign in the formats {names}: leave one of them out')
    if not result:
        return _read_unknown(path, analyse)
    campaign = _read(result[0], path, analyse)
    return campaign.suspected(find_suspicions(campaign))


def check_campaign(files: MeasuredFiles, analyse: Analyse = analyse_uncached) -> Campaign:
    """Read a campaign folder without slow analyses, to check whether it can be read and what looks wrong in it.

    Parameters
    ----------
    files
        Folder with ``campaign.toml``, with the files of it that were read before.
    analyse
        As in `read_campaign`.

    Raises
    ------
    CampaignError
        As `read_campaign`.
    """
    campaign = check_folder(files, analyse)
    return campaign.suspected(find_suspicions(campaign))


def _read_unknown(path: Path, analyse: Analyse) -> Campaign:
    """Raise the error of the folder reader for a path that no format recognises, with the other formats as remedy."""
    others = [item.holds for item in FORMATS if item.read is not read_folder]
    try:
        return read_folder(path, analyse)
    except CampaignError as error:
        more = f"; or give {', or '.join(others)}" if others else ""
        raise CampaignError(f"{error}{more}") from None


def _read(format_: CampaignFormat, path: Path, analyse: Analyse) -> Campaign:
    """Read a campaign by a format; the result of any format but the campaign folder is checked."""
    if format_.read is read_folder:
        return read_folder(path, analyse)
    try:
        campaign = format_.read(path)
    except CampaignError:
        raise
    except Exception as error:
        message = " ".join(str(error).split()) or "no message"
        raise CampaignError(
            f'{path}: the format "{format_.name}" ({FORMATS.entry(format_.name).place}) fails with '
            f"{type(error).__name__} ({message}): correct the file, or the format"
        ) from error
    wrong = _wrong(campaign)
    if wrong:
        raise CampaignError(f'{path}: the format "{format_.name}" gives a campaign {wrong}')
    order = find_sorting(campaign.measurement)
    return replace(campaign, folder=path, measurement=campaign.measurement.where(order))


def _wrong(campaign: Campaign) -> str | None:
    """Description and remedy of content that no comparison can use; None if there is none."""
    table = campaign.measurement
    for called in ([item.name for item in campaign.sensors], [item.name for item in campaign.tests]):
        if len(set(called)) < len(called):
            return f"two of whose sensors or tests have the same name ({', '.join(called)}): give each its own name"
    lengths = {item.name: np.shape(getattr(table, item.name)) for item in fields(table)}
    if len(set(lengths.values())) > 1:
        return f"whose columns have the shapes {lengths}: give each one value per row"
    if not len(table) and not campaign.records:
        return "without any number: add a table of steady states or a time record"
    numbers = np.array([table.level, table.frequency, table.value.real, table.value.imag]).reshape(4, -1)
    if not np.isfinite(numbers).all() or (numbers[:2] <= 0).any():
        return "with a level or frequency that is not positive, or a value that is not finite: leave such rows out"
    ranges = ((table.test, len(campaign.tests)), (table.sensor, len(campaign.sensors)))
    if any(((index < 0) | (index >= count)).any() for index, count in ranges) or (table.harmonic < 0).any():
        return "with a row whose test, sensor or harmonic does not exist: number them from 0"
    if not np.isin(table.sweep, list(SWEEPS)).all():
        return f"with a sweep other than {', '.join(map(str, SWEEPS))}: correct it"
    if len(table) and campaign.held_out.rows(table).all():
        return "with all data held out: leave levels and repeats to train on"
    return None

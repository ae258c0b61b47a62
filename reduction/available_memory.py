"""Free memory, as reported by Linux."""

from pathlib import Path

#: Files with limit and usage of the memory of a control group, for versions 2 and 1.
CGROUP = (("memory.max", "memory.current"), ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes"))

#: Size of arrays up to which the memory check, which reads files, is skipped [byte].
MIN_CHECKED = 2e8


def describe_lacking_memory(needed: float) -> str:
    """Needed and free memory, as the middle of a sentence, if the needed memory is not free; else empty."""
    if needed <= MIN_CHECKED or needed <= (free := read_available_memory()):
        return ""
    return f"about {needed / 1e9:.3g} GB of memory, but {free / 1e9:.3g} GB are free"


def read_available_memory(system: Path = Path("/")) -> float:
    """Memory that this process can use without swapping, limited by the machine and by its control group [byte].

    Parameters
    ----------
    system
        Root folder of the files of Linux; the result is infinite if they do not exist.
    """
    result = [float("inf")]
    meminfo = system / "proc/meminfo"
    if meminfo.is_file():
        values = dict(line.split(":") for line in meminfo.read_text(encoding="ascii").splitlines() if ":" in line)
        result.append(1024.0 * int(values["MemAvailable"].split()[0]))
    for limit, usage in CGROUP:
        files = [system / "sys/fs/cgroup" / name for name in (limit, usage)]
        if all(file.is_file() for file in files):
            most, taken = (file.read_text(encoding="ascii").strip() for file in files)
            result.append(float("inf") if most == "max" else float(most) - float(taken))
    return min(result)

"""Memory that is free, as Linux says it."""

from pathlib import Path

#: Where Linux says what a control group may take and has taken, in its second and in its first version.
CGROUP = (("memory.max", "memory.current"), ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes"))

#: Arrays smaller than this skip the memory check, which reads files [byte].
MIN_CHECKED = 2e8


def describe_lacking_memory(needed: float) -> str:
    """Bytes that are needed and free, as the middle of a sentence, where arrays do not fit; empty where they do."""
    if needed <= MIN_CHECKED or needed <= (free := read_available_memory()):
        return ""
    return f"about {needed / 1e9:.3g} GB of memory, but {free / 1e9:.3g} GB are free"


def read_available_memory(system: Path = Path("/")) -> float:
    """Bytes that this process can take without swapping: of the machine, and of the control group it runs in.

    Parameters
    ----------
    system
        Root of the files in which Linux says so; where they are not, there is no limit.
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

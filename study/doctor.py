"""Missing software of this machine, found with the standard library alone, and the command that installs it.

Software that may be missing is not imported (`geometry.system_library`), and drawing is tried in a separate process.
"""

import ctypes.util
import importlib.metadata
import platform
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from geometry.system_library import DEBIAN_PACKAGE, MEANT_FOR, SYSTEM_LIBRARIES, apt_line, loads, missing_libraries

OLDEST_PYTHON = (3, 11)

# A picture takes a few seconds; the limit is for a graphics driver that hangs.
PICTURE_TIMEOUT = 120.0  # s

# Draws a sphere without a screen and checks that any pixel changed.
TEST_PICTURE = """
import os
os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkRenderingCore import (
    vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter,
)
sphere, mapper, actor = vtkSphereSource(), vtkPolyDataMapper(), vtkActor()
renderer, window = vtkRenderer(), vtkRenderWindow()
mapper.SetInputConnection(sphere.GetOutputPort())
actor.SetMapper(mapper)
renderer.AddActor(actor)
window.SetOffScreenRendering(1)
window.SetSize(64, 64)
window.AddRenderer(renderer)
window.Render()
image = vtkWindowToImageFilter()
image.SetInput(window)
image.Update()
low, high = image.GetOutput().GetPointData().GetScalars().GetRange()
print("drawn by", window.GetClassName() if high > low else "nobody")
"""


@dataclass(frozen=True, kw_only=True)
class CheckResult:
    """Result of one check.

    Parameters
    ----------
    subject
        Name of the checked requirement.
    verdict
        "missing" also if the requirement is installed but does not work.
    detail
        Purpose of the requirement, its version or location, or the fault.
    is_needed
        False for a requirement that only some work needs.
    apt, pip
        Packages that install the requirement.
    """

    subject: str
    verdict: Literal["ok", "missing"]
    detail: str
    is_needed: bool = True
    apt: tuple[str, ...] = ()
    pip: tuple[str, ...] = ()


def examine(cache_folder: Path) -> list[CheckResult]:
    """Check all requirements.

    Parameters
    ----------
    cache_folder
        Folder of stored results.
    """
    return [
        _check_python(),
        *_check_libraries(),
        *_check_packages(),
        _check_picture(),
        _check_cholmod(),
        _check_calculix(),
        _check_cache(cache_folder),
    ]


def make_install_command(findings: Iterable[CheckResult]) -> str:
    """Return one line for the shell that installs all missing packages; empty if nothing is missing."""
    ill = [finding for finding in findings if finding.verdict != "ok"]
    apt = sorted({package for finding in ill for package in finding.apt})
    pip = sorted({package for finding in ill for package in finding.pip})
    parts = [apt_line(apt)] if apt else []
    if pip:
        lock = Path(__file__).resolve().parents[1] / "requirements.lock"
        # The lock file has the tested versions; a checkout contains it, a wheel does not.
        what = ["-r", str(lock)] if lock.is_file() else pip
        parts.append(shlex.join([sys.executable, "-m", "pip", "install", *what]))
    return " && ".join(parts)


def _check_python() -> CheckResult:
    version = platform.python_version()
    detail = f"{version} on {platform.machine()} {platform.system()}"
    if sys.version_info < OLDEST_PYTHON:
        return CheckResult(subject="Python", verdict="missing", detail=f"{detail}; 3.11 or later is needed")
    return CheckResult(subject="Python", verdict="ok", detail=detail)


def _check_libraries() -> list[CheckResult]:
    return [
        CheckResult(
            subject="system libraries",
            verdict="missing" if missing else "ok",
            detail=f"{', '.join(missing)} for {MEANT_FOR[purpose]}" if missing else MEANT_FOR[purpose],
            apt=tuple(DEBIAN_PACKAGE[name] for name in missing),
        )
        for purpose, missing in ((purpose, missing_libraries(purpose)) for purpose in SYSTEM_LIBRARIES)
    ]


def _check_packages() -> list[CheckResult]:
    """Check the Python packages that stickslip declares, without their own dependencies."""
    try:
        declared = importlib.metadata.requires("stickslip") or []
    except importlib.metadata.PackageNotFoundError:
        detail = "is not installed in this environment"
        return [
            CheckResult(subject="Python packages", verdict="missing", detail=f"stickslip {detail}", pip=("stickslip",))
        ]
    missing, present = [], 0
    for line in declared:
        requirement, _, marker = line.partition(";")
        name = re.split(r"[^A-Za-z0-9._-]", requirement.strip(), maxsplit=1)[0]
        if "extra ==" in marker or ("platform_machine" in marker and platform.machine() not in marker):
            continue
        try:
            importlib.metadata.version(name)
            present += 1
        except importlib.metadata.PackageNotFoundError:
            pip = (requirement.strip(),)
            missing.append(CheckResult(subject="Python package", verdict="missing", detail=name, pip=pip))
    return missing or [CheckResult(subject="Python packages", verdict="ok", detail=f"all {present} declared ones")]


def _check_picture() -> CheckResult:
    subject = "off-screen picture"
    if missing_libraries("pictures"):
        return CheckResult(subject=subject, verdict="missing", detail="not tried, since its libraries are missing")
    try:
        trial = subprocess.run(
            [sys.executable, "-c", TEST_PICTURE], capture_output=True, text=True, timeout=PICTURE_TIMEOUT, check=False
        )
    except subprocess.TimeoutExpired:
        return CheckResult(subject=subject, verdict="missing", detail=f"no picture after {PICTURE_TIMEOUT:.0f} s")
    if trial.returncode == 0 and "drawn by" in trial.stdout and "nobody" not in trial.stdout:
        return CheckResult(subject=subject, verdict="ok", detail=trial.stdout.strip().splitlines()[-1])
    if trial.returncode < 0:
        detail = f"drawing crashed with signal {-trial.returncode}"
    else:
        detail = (trial.stderr.strip().splitlines() or ["nothing was drawn"])[-1]
    return CheckResult(subject=subject, verdict="missing", detail=detail, apt=("libegl1", "libgl1", "libgl1-mesa-dri"))


def _check_cholmod() -> CheckResult:
    path = ctypes.util.find_library("cholmod")
    if path is not None and loads(path):
        return CheckResult(
            subject="CHOLMOD", verdict="ok", detail=f"{path}, for large reductions on one or two threads"
        )
    # The package name depends on the release of Debian, so that it is not in the install command.
    packages = "apt-get install libcholmod5, or libcholmod3 on Debian 12"
    detail = f"without libcholmod reductions are slower: {packages}"
    return CheckResult(subject="CHOLMOD", verdict="missing", detail=detail, is_needed=False)


def _check_calculix() -> CheckResult:
    path = shutil.which("ccx")
    detail = path or "ccx, used by some tests as an independent reference, is not installed"
    return CheckResult(
        subject="CalculiX", verdict="ok" if path else "missing", detail=detail, is_needed=False, apt=("calculix-ccx",)
    )


def _check_cache(folder: Path) -> CheckResult:
    subject = "stored results"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return CheckResult(subject=subject, verdict="ok", detail=str(folder))
    except OSError as error:
        detail = f"{folder} cannot be written ({error.strerror}): set STICKSLIP_CACHE to a folder that can"
        return CheckResult(subject=subject, verdict="missing", detail=detail, is_needed=False)

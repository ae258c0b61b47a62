"""What a shell and a script see of `stickslip`: exit codes, standard output for results alone, help without a wait."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from study import console
from study.beam import case as beam_case
from study.cli import ExitCode, _run_guarded

TIMEOUT = 60  # s; a hang is an error, a slow machine is none

# A command that ends in every way there is. The real ones are exercised beside it.
COMMAND = """
import os, time
from pathlib import Path
from study.run_context import DEFAULTS, Answer, Options, make_command_app

app = make_command_app("trial", "Ends in many ways.", examples=["stickslip trial fine"])

def within_callback(kill):
    import ctypes
    def swallowing(*_):
        kill()
        return 0
    ctypes.CFUNCTYPE(ctypes.c_int)(swallowing)()

def within_import(kill):
    try:
        kill()
    except BaseException:
        raise ImportError("numba._devicearray failed to import") from None

SIGNALLED = {"callback": within_callback, "import": within_import, "exec": lambda kill: exec("kill()", {"kill": kill})}

@app.default
def trial(how: str, *, out: Path | None = None, options: Options = DEFAULTS) -> Answer:
    from geometry.errors import GeometryError
    from casefile.errors import CaseError, Problem
    from geometry.errors import ComputationFailed
    run = options.open(out)
    if how in {"long", "table"}:
        from rich.table import Table
        table = Table("n")
        for i in range(6_000): table.add_row(str(i))
        return Answer(document={}, text=table if how == "table" else "line\\n" * 100_000)
    print("chatter of a library")
    os.system("echo chatter of compiled code")
    if how == "geometry": raise GeometryError("length -1 m is negative: give a positive one")
    if how == "case": raise CaseError([Problem(file="a.toml", line=3, key="x", text="x = 1: too small")])
    if how == "failed": raise ComputationFailed("Newton did not converge at 120 Hz")
    if how == "memory": raise MemoryError
    if how == "disk": Path("/dev/full").write_text("x")
    if how == "hdf5": raise RuntimeError("not closed, errno = 28, error message = 'No space', filename = 'a/b.nc'")
    if how == "mistake": return Answer(document={}, text=str(1 / 0))
    if how == "poor": return Answer(document={"worst": float("nan")}, text="poor", exit_code=1)
    if how == "wait":
        print("waiting", flush=True)
        os.write(2, b"waiting\\n")
        time.sleep(60)
    if how in SIGNALLED:
        import signal
        SIGNALLED[how](lambda: os.kill(os.getpid(), signal.SIGTERM))
        time.sleep(60)
    with run.progress.step("a step") as report:
        report(1, 2)
    return Answer(document={"f": [1.5, float("inf")], "case": Path("a")}, text="all [fine] " + "x" * 200)
"""
RUNNER = """
import sys
from study import cli
cli.COMMANDS = (*cli.COMMANDS, ("trial", "trial_command:app", "Ends in many ways."))
sys.exit(cli.main())
"""


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    (tmp_path / "trial_command.py").write_text(COMMAND)
    (tmp_path / "run.py").write_text(RUNNER)
    # Unbuffered output would hide a broken pipe behind a partial write.
    inherited = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    return inherited | {"STICKSLIP_CACHE": str(tmp_path / "cache"), "TMPDIR": str(tmp_path), "COLUMNS": "80"}


def stickslip(environment: dict[str, str], *words: str) -> "subprocess.CompletedProcess[str]":
    """Run the command line with the trial command added."""
    runner = Path(environment["TMPDIR"]) / "run.py"
    return subprocess.run(
        [sys.executable, str(runner), *words],
        env=environment,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )


@pytest.mark.parametrize(
    ("words", "exit_code", "message"),
    [
        (["trial", "fine"], 0, ""),
        (["trial", "poor"], 1, ""),
        (["trial", "failed"], 1, "stickslip: Newton did not converge at 120 Hz\n"),
        (["trial", "memory"], 1, "stickslip: out of memory; use fewer elements"),
        (["trial", "geometry"], 2, "stickslip: length -1 m is negative: give a positive one\n"),
        (["trial", "case"], 2, "a.toml:3: x = 1: too small\n"),
        (["trial"], 2, "requires an argument"),
        (["trial", "fine", "--jsn"], 2, "Did you mean --json"),
        (["trail"], 2, 'Did you mean "trial"'),
        (["--vers"], 2, "stickslip --help"),
        (
            ["cache", "--cache", "/dev/null/x"],
            2,
            "cannot write to the cache /dev/null/x: name another folder with --cache",
        ),
    ],
)
def test_every_end_has_its_exit_code_and_its_sentence(
    environment: dict[str, str], words: list[str], exit_code: int, message: str
) -> None:
    done = stickslip(environment, *words)
    assert done.returncode == exit_code
    assert message in done.stderr
    assert "Traceback" not in done.stderr


needs_full_disk = pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")


@needs_full_disk
@pytest.mark.parametrize(("how", "file"), [("disk", "a file"), ("hdf5", "a/b.nc")])
def test_a_full_disk_is_one_sentence_with_file_and_remedy(environment: dict[str, str], how: str, file: str) -> None:
    done = stickslip(environment, "trial", how, "--json")
    assert done.returncode == 2
    assert done.stderr.count("stickslip: ") == 1
    assert f"{file} cannot be written (No space left on device): free some space" in done.stderr
    assert json.loads(done.stdout)["error"]["exit_code"] == 2


@needs_full_disk
@pytest.mark.parametrize("option", [[], ["--json"]])
def test_standard_output_on_a_full_disk_is_one_sentence_too(environment: dict[str, str], option: list[str]) -> None:
    runner = Path(environment["TMPDIR"]) / "run.py"
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([sys.executable, str(runner), "trial", "long", *option], env=environment, stdout=full,
                              stderr=subprocess.PIPE, text=True, timeout=TIMEOUT, check=False)  # fmt: skip
    assert done.returncode == 2
    assert "standard output cannot be written" in done.stderr
    assert "Traceback" not in done.stderr
    assert "Exception" not in done.stderr


def test_an_output_folder_that_cannot_be_written_is_refused_before_anything_runs(environment: dict[str, str]) -> None:
    done = stickslip(environment, "trial", "fine", "--out", "/dev/null/x")
    assert done.returncode == 2
    assert "the output folder /dev/null/x cannot be written" in done.stderr
    assert "chatter" not in done.stdout


def test_a_mistake_of_the_product_is_short_and_leaves_its_traceback_in_a_file(environment: dict[str, str]) -> None:
    done = stickslip(environment, "trial", "mistake")
    assert done.returncode == 70
    assert done.stderr.count("\n") == 1
    assert "ZeroDivisionError: division by zero" in done.stderr
    file = Path(done.stderr.split()[-1])
    assert "1 / 0" in file.read_text()
    assert "$ stickslip trial mistake" in file.read_text()


@pytest.mark.parametrize(
    "words", [["fine"], ["poor"], ["geometry"], ["case"], ["failed"], ["mistake"], ["x", "--oops"]]
)
def test_with_json_standard_output_is_one_document_and_nothing_else(
    environment: dict[str, str], words: list[str]
) -> None:
    done = stickslip(environment, "trial", *words, "--json")
    document = json.loads(done.stdout, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    if words == ["fine"]:
        assert document == {"f": [1.5, None], "case": "a"}
    elif words == ["poor"]:
        assert (document, done.returncode) == ({"worst": None}, 1)
    else:
        assert document["error"]["exit_code"] == done.returncode > 0
        assert document["error"]["message"] in done.stderr
    if words == ["case"]:
        expected = {"file": "a.toml", "line": 3, "key": "x", "message": "x = 1: too small"}
        assert document["error"]["problems"] == [expected]


def test_text_is_printed_as_it_is(environment: dict[str, str]) -> None:
    assert "all [fine] " + "x" * 200 + "\n" in stickslip(environment, "trial", "fine").stdout


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_and_terminate_end_with_three(environment: dict[str, str], number: int) -> None:
    runner = Path(environment["TMPDIR"]) / "run.py"
    process = subprocess.Popen(
        [sys.executable, str(runner), "trial", "wait"], env=environment, stderr=subprocess.PIPE, text=True
    )
    assert process.stderr is not None
    assert process.stderr.readline() == "waiting\n"
    process.send_signal(number)
    _, errors = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 3
    assert errors.startswith("stickslip: interrupted; finished work is stored")


@pytest.mark.parametrize("how", ["callback", "import", "exec"])
def test_a_signal_ends_a_command_wherever_it_arrives(environment: dict[str, str], how: str) -> None:
    # Compiled code swallows it, an import makes another error of it, and after `exec` Python would end by SIGINT.
    done = stickslip(environment, "trial", how)
    assert done.returncode == 3
    assert "stickslip: interrupted; finished work is stored" in done.stderr
    assert "internal error" not in done.stderr


@pytest.mark.parametrize("how", ["long", "table"])
def test_a_reader_that_has_seen_enough_is_no_error(environment: dict[str, str], how: str) -> None:
    runner = Path(environment["TMPDIR"]) / "run.py"
    command = f"set -o pipefail; {sys.executable} {runner} trial {how} | head -1"
    done = subprocess.run(["bash", "-c", command], env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


HEAVY = (
    "numpy",
    "scipy",
    "pint",
    "pydantic",
    "pyvista",
    "vtkmodules",
    "cadquery",
    "OCP",
    "matplotlib",
    "meshio",
    "h5py",
)


def test_help_imports_nothing_heavy() -> None:
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "stickslip", "--help"], capture_output=True, text=True, check=True
    )
    imported = {line.rpartition("|")[2].strip() for line in done.stderr.splitlines()}
    assert "study.cli" in imported
    assert imported.isdisjoint(HEAVY)
    assert not [name for name in imported if name.startswith("study.command.")]


def test_help_knows_every_command_and_each_has_examples_that_begin_with_its_name() -> None:
    from study.cli import COMMANDS

    overview = subprocess.run(
        [sys.executable, "-m", "stickslip", "--help"], capture_output=True, text=True, check=True
    ).stdout
    assert "Exit codes: 0 done" in overview
    script = "import sys; from study import cli; [cli.main([name, '--help']) for name, _, _ in cli.COMMANDS]"
    pages = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    for name, _, summary in COMMANDS:
        assert name in overview
        assert f"Usage: stickslip {name}" in pages
        # Folded to the width of the terminal, so only its beginning is on one line.
        assert summary[:25] in pages
        assert f" stickslip {name}" in pages.partition(f"Usage: stickslip {name}")[2].partition("Examples:")[2]


def test_version_and_module_agree() -> None:
    import importlib.metadata

    done = subprocess.run([sys.executable, "-m", "stickslip", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == importlib.metadata.version("stickslip")


def test_cache_tells_its_size_and_clears(environment: dict[str, str], tmp_path: Path) -> None:
    from pipeline.store import Store, stage

    Store(tmp_path / "cache").run(stage("one")(_one))
    before = json.loads(stickslip(environment, "cache", "--json").stdout)
    assert before["results"] == 1
    assert before["bytes"] > 0
    assert "removed 1 results" in stickslip(environment, "cache", "--clear").stdout
    assert json.loads(stickslip(environment, "cache", "--json").stdout)["bytes"] == 0


def _one() -> int:
    return 1


def test_an_interruption_inside_compiled_code_is_one(capsys: pytest.CaptureFixture[str]) -> None:
    # Machine code cannot raise: Python puts a SystemError around the KeyboardInterrupt.
    def interrupted() -> None:
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as error:
            raise SystemError("returned a result with an exception set") from error

    with console.standard_output(as_json=False) as output:
        assert _run_guarded(interrupted, ["solve"], output) == ExitCode.INTERRUPTED
    assert "the same command continues from there" in capsys.readouterr().err


def test_the_beam_and_a_campaign_are_written_on_request(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[Path, int]] = []
    monkeypatch.setattr(
        "transient.virtual_bench.hidden_effect.make_campaign", lambda folder, *, seed: asked.append((folder, seed))
    )
    beam_case.main([str(tmp_path / "here")])
    assert {file.name for file in (tmp_path / "here").iterdir()} == {
        "beam.toml", "beam.npz", "beam_finer.toml", "beam_finer.npz",
    }  # fmt: skip
    beam_case.main([str(tmp_path / "there"), "--campaign", "9"])
    assert asked == [(tmp_path / "there" / "campaign", 9)]

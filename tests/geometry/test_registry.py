"""Members are found in a package, in a user's file and through entry points; what is half-declared is refused."""

import pickle
import subprocess
import sys
from abc import ABC, abstractmethod
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path
from textwrap import dedent
from types import SimpleNamespace
from typing import Any

import pytest

import geometry.registry
from geometry.errors import InputWarning, RegistryError
from geometry.registry import Registry, module_name


@pytest.fixture
def springs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Registry[Any]]:
    """A registry in a package of its own with two members, one file each."""
    package = tmp_path / "house" / "springs_for_test"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text(
        dedent(
            """
            from geometry.registry import Registry
            SPRINGS = Registry("spring", package=__name__, group="test.springs", facts={"stiffness": "N per m"},
                               check=lambda spring: "has no stiffness: give one" if spring.stiffness == 0 else None)
            class Spring:
                def __init__(self, **facts):
                    vars(self).update(facts)
            """
        )
    )
    for name in ("soft", "stiff"):
        (package / f"{name}.py").write_text(
            f"from springs_for_test import SPRINGS, Spring\nSPRINGS.register(Spring(name={name!r}, stiffness=1))\n"
        )
    monkeypatch.syspath_prepend(str(tmp_path / "house"))
    yield __import__("springs_for_test").SPRINGS
    # Processes that later tests start would load the files of these ones.
    for name in [name for name in sys.modules if name.startswith(("springs_for_test", geometry.registry.PREFIX))]:
        del sys.modules[name]


def written(folder: Path, text: str, name: str = "mine.py") -> Path:
    file = folder / name
    file.write_text("from springs_for_test import SPRINGS, Spring\n" + dedent(text))
    return file


def test_own_members_are_found_without_a_list_and_only_when_asked_for(springs: Registry[Any]) -> None:
    assert "springs_for_test.soft" not in sys.modules
    assert springs.names() == ["soft", "stiff"]
    assert [member.name for member in springs] == ["soft", "stiff"]
    assert "soft" in springs
    assert "hard" not in springs
    assert springs.outside_files() == []


def test_a_users_file_adds_a_member(springs: Registry[Any], tmp_path: Path) -> None:
    file = written(tmp_path, "SPRINGS.register(Spring(name='mine', stiffness=2))\n")
    (member,) = springs.load(file)
    assert springs.load(str(file)) == (member,)
    assert springs["mine"] is member
    assert springs.outside_files() == [file]
    assert springs.entry("mine").place == f"{file}, line 2"
    springs.forget(file)
    assert "mine" not in springs


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("SPRINGS.register(Spring(name='mine'))", ["mine.py, line 2", '"mine"', "stiffness", "N per m"]),
        ("SPRINGS.register(Spring(stiffness=1))", ["mine.py, line 2", "Spring", "name"]),
        ("SPRINGS.register(Spring(name='', stiffness=1))", ["mine.py, line 2", "''", "text"]),
        ("SPRINGS.register(Spring(name='a', stiffness=0))", ["mine.py, line 2", '"a"', "no stiffness: give one"]),
        ("SPRINGS.register(Spring(name='soft', stiffness=1))", ["mine.py, line 2", '"soft"', "soft.py, line 2"]),
        ("x = 1\n1 / 0", ["mine.py, line 3", "ZeroDivisionError", "correct the file"]),
        ("import no_such_thing", ["mine.py, line 2", "no_such_thing"]),
        ("x = (", ["mine.py, line 2", "SyntaxError"]),
        ("raise SystemExit", ["mine.py, line 2", "SystemExit"]),
        ("", ["mine.py", "registers no spring", "register"]),
    ],
)
def test_a_file_that_fails_is_one_sentence(springs: Registry[Any], tmp_path: Path, text: str, words: list[str]) -> None:
    with pytest.raises(RegistryError) as error:
        springs.load(written(tmp_path, text))
    for word in words:
        assert word in str(error.value)
    assert "\n" not in str(error.value)
    assert springs.names() == ["soft", "stiff"]


def test_a_data_class_without_a_fact_lacks_it_in_plain_words(springs: Registry[Any], tmp_path: Path) -> None:
    text = """
        from dataclasses import dataclass
        @dataclass(frozen=True, kw_only=True)
        class Coil:
            name: str
            stiffness: float
            length: float
        SPRINGS.register(Coil(name="coil"))
        """
    with pytest.raises(RegistryError, match=r"mine\.py, line 9: Coil lacks stiffness \(N per m\), length: add it$"):
        springs.load(written(tmp_path, text))


def test_what_a_failing_file_registered_before_does_not_stay(springs: Registry[Any], tmp_path: Path) -> None:
    with pytest.raises(RegistryError, match="line 3: ZeroDivisionError"):
        springs.load(written(tmp_path, "SPRINGS.register(Spring(name='mine', stiffness=2))\n1 / 0"))
    assert "mine" not in springs


def test_an_abstract_fact_is_a_missing_one_and_members_may_have_another_key(springs: Registry[Any]) -> None:
    class Base(ABC):
        word: str

        @abstractmethod
        def stiffness(self) -> float: ...

    class Half(Base):
        word = "half"

    class Whole(Base):
        word = "whole"

        def stiffness(self) -> float:
            return 1.0

    registry: Registry[type[Base]] = Registry(
        "spring", package=springs.package, group="test.none", key="word", facts={"stiffness": "N per m"}
    )
    assert registry.register(Whole) is registry["whole"]
    with pytest.raises(RegistryError, match='"half" lacks stiffness'):
        registry.register(Half)


def test_a_missing_file_and_an_unknown_name_say_what_there_is(springs: Registry[Any], tmp_path: Path) -> None:
    with pytest.raises(RegistryError, match="no such file"):
        springs.load(tmp_path / "none.py")
    with pytest.raises(RegistryError, match='"hard": choose soft, stiff'):
        springs["hard"]


def test_entry_points_are_loaded_and_a_failing_one_leaves_the_rest(
    springs: Registry[Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(tmp_path, "SPRINGS.register(Spring(name='good', stiffness=2))\n", "good_springs.py")
    written(tmp_path, "SPRINGS.register(Spring(name='bad', stiffness=2))\nnot_there\n", "bad_springs.py")
    monkeypatch.syspath_prepend(str(tmp_path))
    points = [EntryPoint(name, f"{name}_springs", "test.springs") for name in ("bad", "good")]
    monkeypatch.setattr(geometry.registry, "installed_points", lambda group: points if group == "test.springs" else [])
    with pytest.warns(InputWarning, match="bad_springs.py, line 3: NameError"):
        assert springs.names() == ["good", "soft", "stiff"]
    assert len(springs.failures) == 1
    with pytest.raises(RegistryError, match="bad_springs"):
        springs["bad"]


def test_a_class_from_a_users_file_is_found_in_another_process(tmp_path: Path) -> None:
    file = tmp_path / "a class.py"
    file.write_text("class Thing:\n    value = 41\n")
    thing = SimpleNamespace(module=module_name(file))
    pickled = pickle.dumps(__import__(thing.module).Thing())
    script = f"import pickle, geometry.registry; print(pickle.loads({pickled!r}).value + 1)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "42"

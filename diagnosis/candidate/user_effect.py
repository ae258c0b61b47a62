"""User effects, from a short Python file or an installed package.

A file registers kinds of effects (`diagnosis.effect.EFFECTS`), or defines a function `candidates(model)` that lists
effects (`diagnosis.candidate.effect.Effect`) and those that cannot be tested; they exist only for cases that name the
file. A package names a module that registers kinds as an entry point of the group "stickslip.effects". Each call of
these effects is checked: an error is reported in one sentence with file and line.
"""

import importlib.util
import pickle
import sys
import traceback
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectError, EffectParameter, Untestable
from diagnosis.candidate.scale import Scale
from diagnosis.effect import EFFECTS, EffectKind
from geometry.errors import RegistryError

#: Prefix of the names of modules made of files with effects; name of the file and a part of its hash follow.
PREFIX = "stickslip_effects_"
#: Folder of the built-in kinds, whose effects are not checked when they are applied.
OWN = Path(__file__).parents[1] / "effect"
#: Text attributes of an effect.
WORDS = ("name", "kind", "physics", "signature")
#: Arrays of a system that an effect at its neutral values must not change.
LINEAR = ("mass", "damping", "stiffness", "static_load")
#: Attribute of such a module with the kinds that it registered.
KINDS = "_registered_kinds"
OFFER = "register a kind of effect, or give it a function `candidates(model)` that returns a list of effects"


@dataclass(frozen=True, kw_only=True, eq=False)
class OwnEffect:
    """An effect whose class is defined in a user's file: checked when it is applied, and usable in other processes.

    Parameters
    ----------
    effect
        Effect made by the file.
    origin
        Path of the file.
    """

    effect: Effect
    origin: str
    name: str = field(init=False)
    kind: str = field(init=False)
    physics: str = field(init=False)
    signature: str = field(init=False)
    parameters: tuple[EffectParameter, ...] = field(init=False)

    def __post_init__(self) -> None:
        for word in WORDS:
            object.__setattr__(self, word, getattr(self.effect, word))
        object.__setattr__(self, "parameters", tuple(self.effect.parameters))

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """See `Effect`.

        Raises
        ------
        EffectError
            It fails, or does not return a model.
        """
        what = f'`apply` of "{self.name}"'
        changed: object = _call_foreign(lambda: self.effect.apply(model, values), self.origin, what)
        if not isinstance(changed, Model):
            raise EffectError(
                f"{self.origin}: {what} returns a {type(changed).__name__}: return a changed model, as from "
                "model.with_system(...)"
            )
        return changed

    def __reduce__(self) -> tuple[Callable[[str, bytes], "OwnEffect"], tuple[str, bytes]]:
        """Restore the effect by reading its file first, in any process."""
        return _restored, (self.origin, pickle.dumps(self.effect))


@dataclass(frozen=True, kw_only=True, eq=False)
class EffectSource:
    """A file that defines effects.

    Parameters
    ----------
    origin
        Path of the file.
    offer
        Function that lists effects for a model.
    """

    origin: str
    offer: Callable[[Model], Any]

    def candidates(self, model: Model) -> list[Effect | Untestable]:
        """Effects of the file for a model.

        Raises
        ------
        EffectError
            The function fails, or an item is not an effect.
        """
        result: object = _call_foreign(lambda: self.offer(model), self.origin, "`candidates`")
        if isinstance(result, str) or not isinstance(result, Iterable):
            raise EffectError(
                f"{self.origin}: `candidates` returns a {type(result).__name__}: return a list of effects"
            )
        listed = _call_foreign(lambda: list(result), self.origin, "`candidates`")
        return [item if isinstance(item, Untestable) else self._checked(item, model) for item in listed]

    def _checked(self, effect: Any, model: Model) -> OwnEffect:
        def parts() -> tuple[object, ...]:
            return (*(getattr(effect, word, None) for word in WORDS), getattr(effect, "parameters", None))

        *words, parameters = _call_foreign(parts, self.origin, f"a {type(effect).__name__}")
        for word, value in zip(WORDS, words, strict=True):
            if not isinstance(value, str) or not value:
                raise EffectError(
                    f"{self.origin}: the effect {type(effect).__name__} has {word} = {value!r}: give it "
                    f"{', '.join(WORDS)} as words"
                )
        name = words[0]
        listed = isinstance(parameters, Sequence) and all(isinstance(item, EffectParameter) for item in parameters)
        if not listed or not parameters:
            raise EffectError(
                f'{self.origin}: the parameters of "{name}" are {parameters!r}: give a tuple of EffectParameter, the '
                "strength first"
            )
        if not callable(getattr(effect, "apply", None)):
            raise EffectError(f'{self.origin}: "{name}" has no method apply(model, values): give it one')
        own = OwnEffect(effect=effect, origin=self.origin)
        _call_foreign(lambda: pickle.dumps(effect), self.origin, f'storing "{name}" for other processes')
        none = own.apply(model, [item.vanishes for item in parameters])
        for array in LINEAR:
            before, after = getattr(model.system, array), getattr(none.system, array)
            if before.shape != after.shape or not np.allclose(
                after, before, rtol=1e-9, atol=1e-9 * _find_largest(before)
            ):
                raise EffectError(
                    f'{self.origin}: "{name}" changes the {array.replace("_", " ")} at its vanishing values: let '
                    "`apply` return the model as it is there"
                )
        if own.apply(model, [item.typical for item in parameters]) is model:
            raise EffectError(f'{self.origin}: "{name}" changes nothing at its typical values: let `apply` change it')
        return own


def _find_largest(values: Any) -> float:
    return float(np.abs(values).max())


def read_effects(path: str | Path) -> EffectSource:
    """Effects of a Python file, which is run.

    Parameters
    ----------
    path
        Path of a file that registers kinds of effects or has a function `candidates(model)`.

    Raises
    ------
    EffectError
        The file is missing, does not run, or offers no effects.
    """
    file = Path(path).expanduser().resolve()
    if file.suffix != ".py" or not file.is_file():
        raise EffectError(f"{path} is not a Python file of effects: give the path of one, such as effects/tip_stop.py")
    module = _call_foreign(lambda: _load_module(file), str(file), "it")
    kinds: list[EffectKind] = getattr(module, KINDS)
    offer = getattr(module, "candidates", None)
    if kinds:
        return EffectSource(
            origin=str(file), offer=lambda model: [e for kind in kinds for e in kind.candidates(model, None)]
        )
    if not callable(offer):
        raise EffectError(f"{file} defines no effects: {OFFER}")
    return EffectSource(origin=str(file), offer=offer)


def list_checked(kind: EffectKind, model: Model, size: Scale) -> list[Effect | Untestable]:
    """Effects of a kind; those of an external kind are checked when they are created and when they are applied."""
    file = EFFECTS.entry(kind.name).file
    if Path(file).parent == OWN:
        return kind.candidates(model, size)
    return EffectSource(origin=file, offer=lambda model: kind.candidates(model, size)).candidates(model)


def _load_module(file: Path) -> ModuleType:
    # The name contains path and text, so that files of the same name, and versions of a file, are different modules.
    # The module is listed in `sys.modules` so that its classes can be pickled.
    name = _make_module_name(file)
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    before = set(EFFECTS.names())
    try:
        # Not through the loader, which may use stale byte code for a file edited within the same second.
        exec(compile(file.read_bytes(), str(file), "exec"), module.__dict__)
        setattr(module, KINDS, [EFFECTS[kind] for kind in EFFECTS.names() if kind not in before])
    except BaseException:
        del sys.modules[name]
        raise
    finally:
        # The kinds exist only for cases that name the file.
        EFFECTS.forget(file)
    return module


def _make_module_name(file: Path) -> str:
    return f"{PREFIX}{file.stem}_{sha256(str(file).encode() + file.read_bytes()).hexdigest()[:12]}"


def _restored(origin: str, pickled: bytes) -> OwnEffect:
    if PREFIX.encode() in pickled:
        read_effects(origin)
    effect = _call_foreign(lambda: pickle.loads(pickled), origin, "an effect stored with another version of the file")
    return OwnEffect(effect=effect, origin=origin)


def _call_foreign(act: Callable[[], Any], origin: str, what: str) -> Any:
    """Result of foreign code; its errors are reported in one sentence."""
    try:
        return act()
    except (KeyboardInterrupt, GeneratorExit):
        raise
    except RegistryError as error:
        raise EffectError(str(error)) from error
    except BaseException as error:  # a file may even call sys.exit
        line = _describe_line(error, origin)
        words = " ".join(str(error).split()) or "no message"
        raise EffectError(
            f"{origin}{line}: {what} fails with {type(error).__name__} ({words}): correct it, or leave the file out"
        ) from error


def _describe_line(error: BaseException, origin: str) -> str:
    """Line of the file that raised an error, as text after its path."""
    if isinstance(error, SyntaxError) and error.filename == origin:
        return f", line {error.lineno}"
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == origin]
    return f", line {lines[-1]}" if lines else ""

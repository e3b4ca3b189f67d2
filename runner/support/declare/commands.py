"""Options of a command from the parameters of a call, and the arguments of the call from what these were given."""

from __future__ import annotations

import argparse
import inspect
import sys
from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Any, NamedTuple, get_args

from .parameters import Option


class Declared(NamedTuple):
    """A parameter of a call."""

    name: str
    option: Option
    default: Any
    is_switch: bool

    @property
    def flag(self) -> str:
        """How the command line writes it."""
        return self.option.flag or f"--{self.name.replace('_', '-')}"


class _Names(dict[str, Any]):
    """The names of a module; ``Any`` stands for those that only type checkers know."""

    def __missing__(self, name: str) -> Any:
        builtins = vars(sys.modules["builtins"])
        return builtins.get(name, Any)


def declared(call: Callable[..., Any]) -> Iterator[Declared]:
    """The parameters that have an option, in their order; those of ``**changes: Unpack[Changes]``, too."""
    for each in inspect.signature(call).parameters.values():
        said = _said(each.annotation, call.__module__)
        if each.kind is each.VAR_KEYWORD:
            shape = get_args(said)[0]
            for name, text in shape.__annotations__.items():
                yield from _of(name, _said(text, shape.__module__), None)
        else:
            yield from _of(each.name, said, each.default)


def _said(annotation: Any, module: str) -> Any:
    text = getattr(annotation, "__forward_arg__", annotation)
    return eval(text, {}, _Names(vars(sys.modules[module]))) if isinstance(text, str) else text


def _of(name: str, said: Any, default: Any) -> Iterator[Declared]:
    for option in getattr(said, "__metadata__", ()):
        if isinstance(option, Option):
            yield Declared(name, option, default, said.__origin__ is bool)


def add_options(
    parser: Any,
    call: Callable[..., Any],
    *,
    without: Collection[str] = (),
    only: Collection[str] = (),
    dest: Mapping[str, str] | None = None,
) -> None:
    """Give a parser the options of a call; ``dest`` are names for them where they are kept, if others are to be."""
    for each in declared(call):
        name, option, default, is_switch = each
        if name in without or (only and name not in only):
            continue
        kept = (dest or {}).get(name, name)
        is_shown = option.once and default not in (None, (), "", inspect.Parameter.empty) and default is not False
        shown = f" (default: {default})" if is_shown else ""
        given: dict[str, Any] = {"help": option.help + shown}
        if option.is_argument:
            parser.add_argument(name, metavar=option.metavar, nargs=option.count, **given)
            continue
        flags = each.flag.split()
        if is_switch:
            parser.add_argument(*flags, dest=kept, action="store_true", **given)
            continue
        given |= {"metavar": option.metavar, "dest": kept}
        if option.once:
            given |= {"type": option.read, "choices": option.choices, "default": argparse.SUPPRESS}
            given |= {"required": True} if default is inspect.Parameter.empty and not dest else {}
            given |= {} if option.bare is None else {"nargs": "?", "const": option.bare}
        else:
            given |= {"action": "append", "default": argparse.SUPPRESS}
            given |= {"required": True} if default is inspect.Parameter.empty and not dest else {}
        parser.add_argument(*flags, **given)


def arguments(call: Callable[..., Any], options: argparse.Namespace) -> dict[str, Any]:
    """What options give for the parameters of a call; what is not given has its default."""
    return {each.name: getattr(options, each.name) for each in declared(call) if hasattr(options, each.name)}

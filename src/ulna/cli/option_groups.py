"""Options by groups: a command names the dataclasses it takes, Typer sees their fields as its parameters."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from dataclasses import MISSING, Field, fields, is_dataclass
from typing import Any, get_type_hints


def with_groups(command: Callable[..., None]) -> Callable[..., None]:
    """The command as Typer shall see it: in place of each parameter that is a dataclass, that dataclass's fields.

    So an option is written once, as a field whose annotation carries its `typer.Option`, whatever commands take it.

    Raises:
        TypeError: for an option that is given twice.
    """
    hints = get_type_hints(command, include_extras=True)
    groups: dict[str, Any] = {name: kind for name, kind in hints.items() if is_dataclass(kind)}

    def typed(**given: Any) -> None:
        made = {name: kind(**_taken(kind, given)) for name, kind in groups.items()}
        command(**given, **made)

    shown = [
        each
        for parameter in inspect.signature(command).parameters.values()
        for each in (_parameters(groups[parameter.name]) if parameter.name in groups else [_own(parameter, hints)])
    ]
    names = [each.name for each in shown]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise TypeError(f"{command.__name__}: the option {twice[0]} is given twice")
    typed.__name__, typed.__doc__ = command.__name__, command.__doc__
    # Without a default after one with a default is no order for a function, but it is one for keywords.
    typed.__signature__ = inspect.Signature(shown)
    return typed


def _own(parameter: inspect.Parameter, hints: dict[str, Any]) -> inspect.Parameter:
    return parameter.replace(annotation=hints[parameter.name], kind=inspect.Parameter.KEYWORD_ONLY)


def _parameters(group: Any) -> Iterator[inspect.Parameter]:
    hints = get_type_hints(group, include_extras=True)
    for each in fields(group):
        yield inspect.Parameter(
            each.name, inspect.Parameter.KEYWORD_ONLY, annotation=hints[each.name], default=_default(each)
        )


def _default(field: Field[Any]) -> Any:
    if field.default is not MISSING:
        return field.default
    return inspect.Parameter.empty if field.default_factory is MISSING else field.default_factory()


def _taken(group: Any, given: dict[str, Any]) -> dict[str, Any]:
    """The group's part of what is given; the defaults where Typer hands over None."""
    found = {each.name: given.pop(each.name) for each in fields(group)}
    return {name: value for name, value in found.items() if value is not None}

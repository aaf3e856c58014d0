"""What pydantic found wrong, told in the words and at the places of the YAML file."""

from __future__ import annotations

import difflib
import types
from collections.abc import Iterable, Sequence
from datetime import date
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from rig.spec.errors import Problem
from rig.spec.quantity import Unit
from rig.spec.tree import Location, Tree, dotted

_OWN_WORDS = {"quantity", "date", "consistency"}
"""Types of the errors that our own validators raise: their messages say it all."""

_BOUNDS = {
    "greater_than": ("gt", "above"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "below"),
    "less_than_equal": ("le", "at most"),
}


def problems_of(error: ValidationError, tree: Tree, model: type[BaseModel]) -> list[Problem]:
    """Every error of the validation of `tree` against `model`, in the order of the file."""
    problems = [_problem(details, tree, model) for details in error.errors(include_url=False)]
    # A union without a discriminator reports one error for each member at the same place.
    unique: dict[tuple[str, int | None, int | None], Problem] = {}
    for problem in problems:
        unique.setdefault((problem.field, problem.line, problem.column), problem)
    return sorted(unique.values(), key=lambda p: (p.line or 0, p.column or 0))


def first_problem(error: ValidationError) -> str:
    """`place: message` of what was found wrong first, for specs that are of no file."""
    first = error.errors(include_url=False)[0]
    place = ".".join(str(part) for part in first["loc"])
    return f"{place}: {first['msg']}" if place else first["msg"]


def did_you_mean(given: str, known: Iterable[str]) -> str:
    """`; did you mean 'length'?` for a near miss, and what is known in any case."""
    names = list(known)
    close = difflib.get_close_matches(given, names, n=1, cutoff=0.6)
    guess = f"; did you mean '{close[0]}'?" if close else ""
    return f"{guess or ';'} expected {one_of(names)}"


def show(given: Any) -> str:
    """A value from a file in quotes, kept short."""
    if given is None:
        return "nothing"
    if isinstance(given, bool):
        return str(given).lower()
    if isinstance(given, dict):
        return "a mapping"
    if isinstance(given, list):
        return "a list"
    text = str(given)
    return f"'{text if len(text) <= 40 else text[:37] + '...'}'"


def one_of(names: Sequence[str]) -> str:
    """`'a'`, or `one of 'a', 'b'`."""
    quoted = ", ".join(f"'{name}'" for name in names)
    return quoted if len(names) == 1 else f"one of {quoted}"


def _problem(details: ErrorDetails, tree: Tree, model: type[BaseModel]) -> Problem:
    owner, field, location = _walk(details["loc"], tree, model)
    kind = details["type"]
    if kind == "extra_forbidden":
        place = tree.place_of_key(location)
        known = list(owner.model_fields) if owner is not None else []
        given = str(location[-1])
        message = f"unknown key '{given}'{did_you_mean(given, known)}"
    elif kind == "missing":
        place = tree.place_of_value(location[:-1])
        message = f"required, but missing; expected {_expected(field, location)}"
    elif kind in ("union_tag_not_found", "union_tag_invalid"):
        return _wrong_tag(details, tree, location, field)
    else:
        place = tree.place_of_value(location)
        message = _message(details, field, location, tree.value(location))
    return Problem(tree.path, message, dotted(location), place.line, place.column)


def _wrong_tag(
    details: ErrorDetails, tree: Tree, location: Location, field: FieldInfo | None
) -> Problem:
    context = details.get("ctx", {})
    key = str(context["discriminator"]).strip("'")
    alternatives = models_in(field.annotation) if field is not None else []
    expected = [str(name) for m in alternatives for name in _choices(m.model_fields[key])]
    location = (*location, key)
    if details["type"] == "union_tag_not_found":
        message = f"required, but missing; expected {one_of(expected)}"
    else:
        given = str(context["tag"])
        message = f"{show(given)} is not known{did_you_mean(given, expected)}"
    place = tree.place_of_value(location)
    return Problem(tree.path, message, dotted(location), place.line, place.column)


def _message(details: ErrorDetails, field: FieldInfo | None, location: Location, given: Any) -> str:
    kind = details["type"]
    if kind in _BOUNDS:
        return f"{show(given)} is out of range; expected {_expected(field, location)}"
    if kind == "literal_error":
        known = [str(name) for name in _choices(field)]
        return f"{show(given)} is not known{did_you_mean(str(given), known)}"
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        return f"{show(given)} is no mapping; expected 'key: value' lines"
    if kind in ("tuple_type", "list_type"):
        return f"{show(given)} is no list; expected a list such as [a, b]"
    if kind in _OWN_WORDS:
        return details["msg"]
    return f"{show(given)} does not fit; expected {_expected(field, location)}"


def _expected(field: FieldInfo | None, location: Location) -> str:
    """What a field wants, in words: its quantity or type, its bounds, its description."""
    if field is None:
        return "a value"
    if location and isinstance(location[-1], int):
        return _type_words(get_args(field.annotation)[0])
    unit = unit_of(field)
    choices = _choices(field)
    models = models_in(field.annotation)
    if choices:
        what = one_of([str(name) for name in choices])
    elif models:
        keys = dict.fromkeys(
            k for m in models for k, f in m.model_fields.items() if f.is_required()
        )
        what = f"a mapping with {', '.join(keys)}" if keys else "a mapping"
    else:
        what = unit.expected if unit else _type_words(field.annotation)
        what += _bounds(field, unit)
    return f"{what}: {field.description}" if field.description else what


def _bounds(field: FieldInfo, unit: Unit | None) -> str:
    limits = []
    for metadata in field.metadata:
        for key, words in _BOUNDS.values():
            bound = getattr(metadata, key, None)
            if bound is not None:
                limits.append(f"{words} {unit.in_lab_units(bound) if unit else bound}")
        length = getattr(metadata, "min_length", None)
        if length is not None:
            limits.append("not empty")
    return f", {' and '.join(limits)}" if limits else ""


def unit_of(field: FieldInfo) -> Unit | None:
    """The quantity that a field holds, or may hold; None if it is something else."""
    metadata = list(field.metadata)
    if get_origin(field.annotation) in (Union, types.UnionType):
        for inner in get_args(field.annotation):
            metadata += getattr(inner, "__metadata__", ())
    return next((m for m in metadata if isinstance(m, Unit)), None)


def _type_words(annotation: Any) -> str:
    """`a whole number or text` for `int | str`."""
    origin = get_origin(annotation)
    if origin is Annotated:
        return _type_words(get_args(annotation)[0])
    if origin in (Union, types.UnionType):
        words = [_type_words(inner) for inner in get_args(annotation) if inner is not type(None)]
        return " or ".join(words)
    if origin in (tuple, list):
        return "a list"
    return _TYPE_WORDS.get(annotation, "a value")


_TYPE_WORDS: dict[Any, str] = {
    int: "a whole number",
    float: "a number",
    str: "text",
    date: "a date as 2025-01-31",
}


def _choices(field: FieldInfo | None) -> tuple[Any, ...]:
    annotation = field.annotation if field else None
    if get_origin(annotation) in (tuple, Union, types.UnionType):
        annotation = get_args(annotation)[0]
    return get_args(annotation) if get_origin(annotation) is Literal else ()


def _walk(
    loc: tuple[int | str, ...], tree: Tree, model: type[BaseModel]
) -> tuple[type[BaseModel] | None, FieldInfo | None, Location]:
    """Owner model, field and YAML location of pydantic's `loc`.

    Pydantic's locations name the chosen member of a union, too; those are no keys of the file.
    """
    owner: type[BaseModel] | None = model
    field: FieldInfo | None = None
    location: Location = ()
    candidates: list[type[BaseModel]] = [model]
    for part in loc:
        tagged = [m for m in candidates if _has_tag(m, part)]
        if len(candidates) > 1 and tagged:
            candidates = tagged
            continue
        if isinstance(part, str) and not candidates and not _is_key(tree, (*location, part)):
            continue  # the name of a type in a plain union such as `int | str`
        location = (*location, part)
        if isinstance(part, int):
            continue  # an item of a list: same candidates
        owner = candidates[0] if candidates else None
        field = owner.model_fields.get(part) if owner is not None else None
        candidates = models_in(field.annotation) if field is not None else []
    return owner, field, location


def _is_key(tree: Tree, location: Location) -> bool:
    return location in tree.keys


def _has_tag(model: type[BaseModel], part: int | str) -> bool:
    return any(
        get_origin(f.annotation) is Literal and part in get_args(f.annotation)
        for f in model.model_fields.values()
    )


def models_in(annotation: Any) -> list[type[BaseModel]]:
    """Models inside an annotation: of unions, optionals and lists."""
    origin = get_origin(annotation)
    if origin is Annotated:
        return models_in(get_args(annotation)[0])
    if origin in (Union, types.UnionType, tuple, list):
        return [m for inner in get_args(annotation) for m in models_in(inner)]
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return []

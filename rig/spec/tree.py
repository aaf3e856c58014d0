"""YAML text as plain Python data that remembers line and column of every key and value.

Only what specs need: mappings with text keys, lists, text, numbers, booleans, dates, null.
"""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML, MappingNode, ScalarNode, SequenceNode
from ruamel.yaml.error import MarkedYAMLError, StringMark, YAMLError
from ruamel.yaml.reader import ReaderError

from rig.spec.errors import Problem, SpecError

MAX_CHARACTERS = 1_000_000
MAX_NODES = 50_000  # aliases of aliases could otherwise grow without bound

Location = tuple[str | int, ...]
"""Keys and list indices from the root to a value."""


@dataclass(frozen=True)
class Place:
    """A position in a file, from 1."""

    line: int
    column: int


@dataclass
class Tree:
    """Parsed YAML: `data`, and where its keys and values stand."""

    path: Path
    data: Any = None
    values: dict[Location, Place] = field(default_factory=dict)
    keys: dict[Location, Place] = field(default_factory=dict)

    def value(self, location: Location) -> Any:
        """The data at `location`; None if there is none."""
        data = self.data
        for part in location:
            if isinstance(data, dict):
                data = data.get(part)
            elif isinstance(data, list) and isinstance(part, int) and part < len(data):
                data = data[part]
            else:
                return None
        return data

    def place_of_value(self, location: Location) -> Place:
        """Where the value at `location` begins; that of its nearest parent if it is absent."""
        while location not in self.values and location:
            location = location[:-1]
        return self.values.get(location, Place(1, 1))

    def place_of_key(self, location: Location) -> Place:
        """Where the key of `location` stands; its value's place for list items."""
        return self.keys.get(location) or self.place_of_value(location)


def parse_tree(text: str, path: Path) -> Tree:
    """Parse one YAML document.

    Raises SpecError, with every problem found, for text that is no YAML, an empty document, a top
    level that is not a mapping, duplicate keys, keys that are not text, and tags.
    """
    node = _compose(text, path)
    if node is None:
        raise SpecError([Problem(path, "the file is empty; expected a spec with a 'kind'")])
    builder = _Builder(path)
    data = builder.build(node, ())
    if not builder.problems and not isinstance(data, dict):
        builder.complain(node, (), "expected 'key: value' lines at the top level")
    if builder.problems:
        raise SpecError(builder.problems)
    builder.tree.data = data
    return builder.tree


def _compose(text: str, path: Path) -> Any:
    if len(text) > MAX_CHARACTERS:
        raise SpecError([Problem(path, f"longer than {MAX_CHARACTERS} characters: no spec")])
    yaml = YAML(typ="safe", pure=True)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a reused anchor is legal YAML
            return yaml.compose(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        what = " ".join(str(part) for part in (error.context, error.problem) if part)
        place = _place(mark) if mark is not None else Place(1, 1)
        problem = Problem(path, f"not valid YAML: {what}", "", place.line, place.column)
    except ReaderError as error:
        before = text[: error.position]
        line = before.count("\n") + 1
        column = len(before) - (before.rfind("\n") + 1) + 1
        what = f"the character U+{ord(text[error.position]):04X} is not allowed in YAML"
        problem = Problem(path, what, "", line, column)
    except RecursionError:
        problem = Problem(path, "not valid YAML: nested too deeply")
    except YAMLError as error:
        problem = Problem(path, f"not valid YAML: {error}")
    except Exception as error:  # the parser stumbles over some malformed text in its own ways
        problem = Problem(path, f"not valid YAML: the parser says '{error}'")
    raise SpecError([problem]) from None


def _place(mark: StringMark) -> Place:
    return Place(mark.line + 1, mark.column + 1)


class _Builder:
    """Turns YAML nodes into Python data; collects problems instead of stopping at the first."""

    def __init__(self, path: Path) -> None:
        self.tree = Tree(path)
        self.problems: list[Problem] = []
        self._nodes = 0
        self._open: list[int] = []

    def complain(self, node: Any, location: Location, message: str) -> None:
        place = _place(node.start_mark)
        self.problems.append(
            Problem(self.tree.path, message, dotted(location), place.line, place.column)
        )

    def build(self, node: Any, location: Location) -> Any:
        self._nodes += 1
        if self._nodes > MAX_NODES:
            if self._nodes == MAX_NODES + 1:
                self.complain(node, location, f"more than {MAX_NODES} values: no spec")
            return None
        self.tree.values[location] = _place(node.start_mark)
        if isinstance(node, ScalarNode):
            return self._scalar(node, location)
        if id(node) in self._open:
            self.complain(node, location, "an alias refers to the value that contains it")
            return None
        self._open.append(id(node))
        try:
            if isinstance(node, MappingNode):
                return self._mapping(node, location)
            return self._sequence(node, location)
        finally:
            self._open.pop()

    def _mapping(self, node: MappingNode, location: Location) -> dict[str, Any]:
        self._check_tag(node, location, "map")
        result: dict[str, Any] = {}
        first_lines: dict[str, int] = {}
        for key_node, value_node in node.value:
            if key_node.tag == _tag("merge"):
                message = "merge keys are not used in specs; write the keys out"
                self.complain(key_node, location, message)
                continue
            if not isinstance(key_node, ScalarNode):
                self.complain(key_node, location, "expected plain text as key")
                continue
            try:
                key = _whole(key_node.value)
            except ValueError as error:
                self.complain(key_node, location, str(error))
                continue
            if key in first_lines:
                message = f"duplicate key '{key}', first given in line {first_lines[key]}; keep one"
                self.complain(key_node, (*location, key), message)
                continue
            place = _place(key_node.start_mark)
            first_lines[key] = place.line
            self.tree.keys[(*location, key)] = place
            result[key] = self.build(value_node, (*location, key))
        return result

    def _sequence(self, node: SequenceNode, location: Location) -> list[Any]:
        self._check_tag(node, location, "seq")
        return [self.build(item, (*location, i)) for i, item in enumerate(node.value)]

    def _check_tag(self, node: Any, location: Location, expected: str) -> None:
        if str(node.tag) != _tag(expected):
            self.complain(node, location, f"the tag '{node.tag}' is not used in specs; remove it")

    def _scalar(self, node: ScalarNode, location: Location) -> Any:
        tag = str(node.tag)
        if tag == _tag("str"):
            try:
                return _whole(node.value)
            except ValueError as error:
                self.complain(node, location, str(error))
                return None
        text = str(node.value)
        try:
            if tag == _tag("null"):
                return None
            if tag == _tag("bool"):
                return text.lower() == "true"
            if tag == _tag("int"):
                return _integer(text)
            if tag == _tag("float"):
                return float(
                    text.lower().replace("_", "").replace(".inf", "inf").replace(".nan", "nan")
                )
            if tag == _tag("timestamp"):
                return date.fromisoformat(text) if _DATE.fullmatch(text) else text
        except ValueError:
            self.complain(node, location, f"'{text[:40]}' is not a valid {tag.rsplit(':', 1)[-1]}")
            return None
        self.complain(node, location, f"the tag '{tag}' is not used in specs; remove it")
        return None


_DATE = re.compile(r"\d{4}-\d{2}-\d{2}")


def _tag(name: str) -> str:
    return f"tag:yaml.org,2002:{name}"


def _whole(text: str) -> str:
    """`text` with pairs of surrogates joined, as JSON escapes them; ValueError for half a pair."""
    try:
        return text.encode("utf-16", "surrogatepass").decode("utf-16")
    except UnicodeDecodeError:
        raise ValueError("half a character (a lone surrogate) is no text") from None


def _integer(text: str) -> int:
    digits = text.replace("_", "")
    prefix = digits.lstrip("+-")[:2].lower()
    return int(digits, 0) if prefix in ("0x", "0o", "0b") else int(digits)


def dotted(location: Location) -> str:
    """`geometry.distortion[2]` for ("geometry", "distortion", 2)."""
    text = ""
    for part in location:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text

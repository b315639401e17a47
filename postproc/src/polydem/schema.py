"""The JSON Schema of the dictionary of a namelist, and checks of a group by it."""

from __future__ import annotations

import json
import math
import operator
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from .errors import InputError

#: Keywords of bounds: what holds of a value and the bound, and how it is said
BOUNDS = {"minimum": (operator.ge, ">="), "exclusiveMinimum": (operator.gt, ">"),
          "maximum": (operator.le, "<="), "exclusiveMaximum": (operator.lt, "<")}
#: Types of JSON by those of Python; a bool is an int
TYPES = {bool: "boolean", int: "integer", float: "number", str: "string", list: "array", tuple: "array"}


def schema() -> dict[str, Any]:
    """The JSON Schema (2020-12) of the dictionary that a `Simulation` takes."""
    found: dict[str, Any] = json.loads(Path(__file__).with_name("schema.json").read_text(encoding="utf-8"))
    return found


@cache
def _entries(group: str) -> Mapping[str, Any]:
    """The schemas of the entries of a group."""
    found = schema()["properties"][group]
    entries: Mapping[str, Any] = found.get("properties") or found["additionalProperties"]["properties"]
    return entries


def made(group: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """The dictionary of a group of those entries that are not None; a name may end with _, as from_."""
    entries = {key.rstrip("_"): value for key, value in given.items() if value is not None}
    for key, value in entries.items():
        problem = _problem(value, _entries(group)[key])
        if problem:
            raise InputError(f"{key} of &{group} {problem}, not {value!r}")
    return entries


def _problem(value: Any, rule: Mapping[str, Any]) -> str:
    """What a value must be, but is not; empty: nothing."""
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.ravel().tolist() if isinstance(value, np.ndarray) else value.item()
    kinds = rule["type"] if isinstance(rule["type"], list) else [rule["type"]]
    kind = TYPES.get(type(value), "")
    if kind not in kinds and not (kind == "integer" and "number" in kinds):
        return f"must be of type {' or '.join(kinds)}"
    if kind == "array":
        least, most = rule["minItems"], rule.get("maxItems", math.inf)
        if not least <= len(value) <= most:
            return f"must have {least} values" if least == most else "must have a value"
        return next(filter(None, (_problem(each, rule["items"]) for each in value)), "")
    if kind == "string":
        return _problem_of_text(value, rule)
    return "must be finite" if not math.isfinite(value) else _problem_of_number(value, rule)


def _problem_of_text(value: str, rule: Mapping[str, Any]) -> str:
    if "enum" in rule and value not in rule["enum"]:
        return f"must be one of {', '.join(rule['enum'])}"
    if len(value) < rule.get("minLength", 0):
        return "must not be empty"
    if len(value) > rule.get("maxLength", math.inf) or not re.search(rule.get("pattern", ""), value):
        return "must be a name of at most 64 letters, digits and _"
    return ""


def _problem_of_number(value: float, rule: Mapping[str, Any]) -> str:
    choices = [_problem_of_number(value, {**each}) for each in rule.get("anyOf", [])]
    if choices:
        return " or ".join(choices) if all(choices) else ""
    return next((f"must be {sign} {rule[word]:.10g}" for word, (holds, sign) in BOUNDS.items()
                 if word in rule and not holds(value, rule[word])), "")

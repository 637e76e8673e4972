"""Words for pydantic's types of error, in terms of YAML instead of Python."""

import re
from collections.abc import Sequence
from typing import Any

from specc.diagnostics import nearest
from specc.schema.base import PYTHON_PATH

_KINDS = {
    "a mapping": ("model_type", "model_attributes_type", "dict_type", "mapping_type"),
    "a list": ("list_type", "tuple_type", "set_type", "frozen_set_type", "iterable_type"),
    "text": ("string_type",),
    "a whole number": ("int_type", "int_parsing", "int_from_float"),
    "a number": ("float_type", "float_parsing", "decimal_type", "decimal_parsing"),
    "true or false": ("bool_type", "bool_parsing"),
    "nothing": ("none_required",),
}
_EXPECTED = {error: kind for kind, errors in _KINDS.items() for error in errors}
_FOUND: tuple[tuple[type, str], ...] = (
    (bool, "{value}"),
    (int, "the number {value}"),
    (float, "the number {value}"),
    (str, "text"),
    (list, "a list"),
    (tuple, "a list"),
    (dict, "a mapping"),
)
_RULES = {
    "greater_than": "must be greater than {gt}",
    "greater_than_equal": "must be at least {ge}",
    "less_than": "must be less than {lt}",
    "less_than_equal": "must be at most {le}",
    "multiple_of": "must be a multiple of {multiple_of}",
    "string_too_short": "must have at least {min_length} characters",
    "string_too_long": "must have at most {max_length} characters",
    "string_pattern_mismatch": "does not have the form {form}",
    "too_short": "must have at least {min_length} items",
    "too_long": "must have at most {max_length} items",
    "finite_number": "must be a finite number",
}
_FORMS = {PYTHON_PATH: "`package.module:name`"}
_WRITTEN = {
    "a mapping": "a mapping is written `{key: value}`, or `key: value` on lines of its own below",
    "a list": "a list is written `[a, b]`, or `- a` on lines of its own below",
    "text": "text is one value, in quotes if it has brackets, braces or a colon",
    "a whole number": "write digits only, without quotes",
    "a number": "write digits, without quotes",
    "true or false": "write `true` or `false`, without quotes",
}
_NAMES = {
    "not_a_name": (
        "{} is not a name",
        "a name is letters, digits and `_`, and does not begin with a digit",
    ),
    "private_name": (
        "{} begins with two underscores, which makes it private in Python",
        "choose another name",
    ),
    "keyword_in_path": (
        "{} has a keyword of Python in it and cannot be imported",
        "write `package.module:name`",
    ),
    "word_of_expressions": ("{} is a word of the expression language", "choose another name"),
}
_PLAIN = re.compile(r"[\w./-]+")
_SHOWN = 60


def expected_kind(error_type: str) -> str | None:
    """The kind of value that an error misses; None if the error is not about the kind."""
    return _EXPECTED.get(error_type)


def kind_of(value: Any) -> str:
    """Words for what stands in the file."""
    for kind, words in _FOUND:
        if isinstance(value, kind):
            return words.format(value=str(value).lower() if kind is bool else value)
    return "nothing"


def way_to(expected: str, value: Any, needed: Sequence[str] = ()) -> str:
    """How a value of the expected kind is written; `value` stands there now.

    `needed` are the keys that an expected mapping cannot do without.
    """
    if value is None:
        return "write what belongs here, or delete the key"
    kind = expected.partition(" or ")[0]
    if kind == "text" and isinstance(value, (bool, int, float)):
        return f'a value in quotes is text: `"{str(value).lower()}"`'
    if kind == "a mapping" and needed:
        return f"write `{{{', '.join(f'{key}: ...' for key in needed)}}}`"
    if kind == "a list" and isinstance(value, str) and _PLAIN.fullmatch(value):
        return f"write `[{value}]`"
    return _WRITTEN.get(kind, "")


def invalid_value(
    error_type: str, message: str, context: dict[str, Any], value: Any
) -> tuple[str, str]:
    """What is wrong with a value of the right kind, and a way out if there is one."""
    if error_type in ("literal_error", "enum", "union_tag_invalid"):
        return _one_of(context, value)
    if error_type in _NAMES:
        return _no_name(error_type, context["meant"], value)
    if error_type == "value_error":
        return message.removeprefix("Value error, "), ""
    if error_type == "assertion_error":
        return message.removeprefix("Assertion failed, "), ""
    if error_type == "row_length":
        return message, f"write `[{context['keys']}]`"
    rule = _RULES.get(error_type)
    if rule is None:
        return message[:1].lower() + message[1:], ""
    if error_type == "string_too_short" and not value:
        return "the text is empty", "write a few words"
    pattern = context.get("pattern", "")
    form = _FORMS.get(pattern, f"`{pattern}`")
    words = rule.format(**context, form=form)
    return f"{_shown(value)} {words}", f"write {form}" if pattern else ""


def _no_name(error_type: str, meant: str, value: Any) -> tuple[str, str]:
    message, hint = _NAMES[error_type]
    return message.format(_shown(value)), f"{hint}, e.g. `{meant}`" if meant else hint


def _one_of(context: dict[str, Any], value: Any) -> tuple[str, str]:
    expected = str(context.get("expected") or context.get("expected_tags") or context.get("tag"))
    names = [name.strip(" '") for name in expected.replace(" or ", ", ").split(",")]
    close = nearest(value, names) if isinstance(value, str) else []
    hint = f"did you mean `{close[0]}`?" if close else "write one of them"
    return f"{_shown(value)} is not one of {', '.join(f'`{name}`' for name in names)}", hint


def _shown(value: Any) -> str:
    if isinstance(value, (dict, list, tuple)):
        return kind_of(value)
    text = str(value)
    return f"`{text}`" if len(text) <= _SHOWN else f"`{text[:_SHOWN]}...`"

"""Words for pydantic's types of error, in terms of YAML instead of Python."""

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
_FORMS = {PYTHON_PATH: "package.module:name"}
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


def invalid_value(
    error_type: str, message: str, context: dict[str, Any], value: Any
) -> tuple[str, str]:
    """What is wrong with a value of the right kind, and a way out if there is one."""
    if error_type in ("literal_error", "enum", "union_tag_invalid"):
        return _one_of(context, value)
    if error_type == "value_error":
        return message.removeprefix("Value error, "), ""
    if error_type == "assertion_error":
        return message.removeprefix("Assertion failed, "), ""
    rule = _RULES.get(error_type)
    if rule is None:
        return message[:1].lower() + message[1:], ""
    pattern = context.get("pattern", "")
    words = rule.format(**context, form=_FORMS.get(pattern, pattern))
    return f"{_shown(value)} {words}", ""


def _one_of(context: dict[str, Any], value: Any) -> tuple[str, str]:
    expected = str(context.get("expected") or context.get("expected_tags") or context.get("tag"))
    names = [name.strip(" '") for name in expected.replace(" or ", ", ").split(",")]
    close = nearest(value, names) if isinstance(value, str) else []
    hint = f"did you mean `{close[0]}`?" if close else ""
    return f"{_shown(value)} is not one of {', '.join(names)}", hint


def _shown(value: Any) -> str:
    if isinstance(value, (dict, list, tuple)):
        return kind_of(value)
    text = str(value)
    return f"`{text}`" if len(text) <= _SHOWN else f"`{text[:_SHOWN]}...`"

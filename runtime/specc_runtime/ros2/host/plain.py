"""Messages of ROS 2 to plain data and back: dictionaries, lists, numbers, texts and bytes."""

from __future__ import annotations

from array import array
from importlib import import_module
from typing import Any

from specc_runtime.hosting.devices import DeviceError


def interface(name: str, kind: str = "msg") -> Any:
    """The class of `package/Type` or `package/msg/Type`; `kind` may be "action" or "srv".

    Raises DeviceError, with the package that is missing, if this ROS does not have it.
    """
    parts = name.split("/")
    package, last = parts[0], parts[-1]
    try:
        return getattr(import_module(f"{package}.{kind}"), last)
    except ImportError as error:
        raise DeviceError(
            f"this ROS has no package `{package}` with `{name}` ({error}): source the workspace "
            "that has it"
        ) from error
    except AttributeError as error:
        raise DeviceError(f"package `{package}` has no {kind} `{last}`") from error


def interface_name(cls: Any) -> str:
    """`package/msg/Type` of a class of messages, as ROS 2 names it."""
    package, kind = cls.__module__.split(".")[:2]
    return f"{package}/{kind}/{cls.__name__}"


_MESSAGES = {"goal": "Goal", "feedback": "Feedback", "result": "Result", "response": "Response"}
"""The classes of parts of actions and services; a `request` is a goal or a request."""


def check_field(topic: dict[str, Any]) -> None:
    """Raises DeviceError if the messages of an element have no field of the name that it says, or
    one of another kind.
    """
    kind, _, _ = topic["interface"].partition("_")
    cls = interface(topic["type"], {"action": "action", "service": "srv"}.get(kind, "msg"))
    if kind:
        request = "Goal" if kind == "action" else "Request"
        cls = getattr(cls, _MESSAGES.get(topic["part"], request))
    at, declared = cls(), topic["type"]
    what = f"{topic['topic']} ({topic['name']}): "
    for name in filter(None, topic["path"].split(".")):
        known: dict[str, str] = getattr(at, "get_fields_and_field_types", dict)()
        if name not in known:
            has = f"it has {', '.join(known)}" if known else "it has none"
            raise DeviceError(f"{what}{declared} has no field `{name}`: {has}")
        at, declared = getattr(at, name), known[name]
    is_array = not isinstance(at, str) and hasattr(at, "__len__")
    if topic["path"] and is_array != (topic["shape"] in _ARRAYS) and topic["shape"] in _PLAIN:
        wanted = "an array" if topic["shape"] in _ARRAYS else "one value"
        raise DeviceError(f"{what}`{topic['path']}` is {declared}, and the element is {wanted}")


_ARRAYS = ("vector", "tuple", "camera", "joints")
_PLAIN = ("scalar", *_ARRAYS)
"""Shapes of values that are no messages."""


def plain(value: Any) -> Any:
    """Plain data of a message or a value in one: fields by name; bytes for arrays of uint8."""
    if isinstance(value, (float, int, str, bytes)):
        return value
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, array):
        return value.tobytes() if value.typecode == "B" else value.tolist()
    if hasattr(value, "tolist"):  # an array of numpy, in which rclpy has those of a fixed size
        return value.tolist()
    return [plain(item) for item in value]


def fill(message: Any, data: Any, where: str = "") -> Any:
    """The message with fields set from plain data; others stay as they are.

    Raises DeviceError, with the path of the field, for a field that the message does not have and
    for what it cannot take: rclpy may not look, and then converts whatever it finds.
    """
    if not isinstance(data, dict):
        raise DeviceError(f"{_title(where, message)} takes its fields by name, not {_kind(data)}")
    if hasattr(message, "_check_fields"):
        message._check_fields = True
    types = dict(zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True))
    for name, value in data.items():
        if name not in types:
            known = ", ".join(types)
            raise DeviceError(f"{_title(where, message)} has no field `{name}`: it has {known}")
        path = f"{where}.{name}" if where else name
        try:
            setattr(message, name, _converted(types[name], value, getattr(message, name), path))
        except (AssertionError, TypeError, ValueError, OverflowError) as error:
            declared = message.get_fields_and_field_types()[name]
            raise DeviceError(f"`{path}` is {declared}, not {_kind(value)}") from error
    return message


def _converted(declared: Any, value: Any, present: Any, where: str) -> Any:
    """What a field of that type is set to."""
    if hasattr(present, "get_fields_and_field_types"):
        if isinstance(value, float) and interface_name(type(present)) == DURATION:
            value = duration(value)
        return fill(present, value, where)
    element = getattr(declared, "value_type", None)
    if element is None:
        return _number(getattr(declared, "typename", ""), value)
    if hasattr(element, "namespaces"):
        cls = interface("/".join((*element.namespaces, element.name)))
        return [fill(cls(), item, f"{where}[{n}]") for n, item in enumerate(value)]
    if isinstance(value, bytes):
        return array("B", value) if isinstance(present, array) else list(value)
    if getattr(present, "typecode", "") == "d" and {*map(type, value)} <= {float, int}:
        return array("d", value)  # rclpy looks at each item of a list
    return [_number(getattr(element, "typename", ""), item) for item in value]


DURATION = "builtin_interfaces/msg/Duration"
"""A number for one is that of its seconds."""


def duration(seconds: float) -> dict[str, int]:
    """The fields of a duration."""
    sec, nanosec = divmod(round(seconds * 1e9), 10**9)
    return {"sec": sec, "nanosec": nanosec}


_REAL = ("float", "double", "long double")


def _number(typename: str, value: Any) -> Any:
    """A whole number is a real one, too."""
    if typename in _REAL and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    return value


def _title(where: str, message: Any) -> str:
    name = interface_name(type(message))
    return f"`{where}` ({name})" if where else f"`{name}`"


def _kind(value: Any) -> str:
    text = repr(value)
    return f"{type(value).__name__} {text if len(text) <= 40 else text[:37] + '...'}"

"""From pydantic's location of an error to a route in the YAML.

Pydantic adds steps of its own to a location: the names of union members, validators and "[key]".
Walking the location along the model tells them from keys of the file.
"""

from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from pydantic import BaseModel, RootModel, Tag

from specc.frozen import frozen
from specc.source import Route

_KEY_MARK = "[key]"


@frozen
class Location:
    """Where an error is.

    `choices` are the union members that pydantic tried on the way, each with the route of its
    union; `owner` is the model whose keys stand at the last step of the route, if known, and
    `wanted` the one that describes the value there.
    """

    route: Route
    is_key: bool
    choices: tuple[tuple[Route, str], ...]
    owner: type[BaseModel] | None
    wanted: type[BaseModel] | None = None


def locate(loc: tuple[str | int, ...], model: Any) -> Location:
    """The route of an error that validating a `model` reported at `loc`."""
    route: list[str | int] = []
    choices: list[tuple[Route, str]] = []
    owner: type[BaseModel] | None = None
    annotation: Any = model
    for step in loc:
        if step == _KEY_MARK:
            return Location(tuple(route), True, tuple(choices), None)
        annotation = _bare(annotation)
        members = _members(annotation)
        if members:
            choices.append((tuple(route), str(step)))
            annotation = _member(members, str(step))
            continue
        if annotation is Any and isinstance(step, str) and "[" in step:
            continue
        owner = annotation if _is_model(annotation) else None
        route.append(step)
        annotation = _below(annotation, step)
    last = _bare(annotation)
    wanted = last if _is_model(last) else None
    return Location(tuple(route), False, tuple(choices), owner, wanted)


def needed_keys_of(model: type[BaseModel]) -> list[str]:
    """The keys that a mapping of this model cannot do without, as the file spells them."""
    fields = model.model_fields.items()
    return [field.alias or name for name, field in fields if field.is_required()]


def keys_of(model: type[BaseModel]) -> list[str]:
    """The keys that a mapping of this model takes, as the file spells them."""
    return [field.alias or name for name, field in model.model_fields.items()]


def _is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def _bare(annotation: Any) -> Any:
    """The type without metadata, without None as an alternative and without a root model."""
    while True:
        if get_origin(annotation) is Annotated:
            annotation = get_args(annotation)[0]
        elif hasattr(annotation, "__value__"):
            annotation = annotation.__value__
        elif _is_model(annotation) and issubclass(annotation, RootModel):
            annotation = annotation.model_fields["root"].annotation
        elif len(members := _alternatives(annotation)) == 1:
            annotation = members[0]
        else:
            return annotation


def _alternatives(annotation: Any) -> list[Any]:
    if get_origin(annotation) not in (Union, UnionType):
        return []
    return [member for member in get_args(annotation) if member is not NoneType]


def _members(annotation: Any) -> list[Any]:
    alternatives = _alternatives(annotation)
    return alternatives if len(alternatives) > 1 else []


def _member(members: list[Any], label: str) -> Any:
    """The member of a union that pydantic calls `label`; Any if it is not recognised."""
    for matches in (str.__eq__, _is_named_in):
        for member in members:
            if any(matches(name, label) for name in _labels(member)):
                return member
    return Any


def _is_named_in(name: str, label: str) -> bool:
    # Validators around a member are named around it: function-before[expand(), Model].
    return label.startswith(f"{name}[") or label.endswith(f", {name}]")


def _labels(member: Any) -> list[str]:
    tags = [part.tag for part in get_args(member)[1:] if isinstance(part, Tag)]
    bare = _bare(member)
    if get_origin(bare) is Literal:
        return [*tags, "literal"]
    name = getattr(get_origin(bare) or bare, "__name__", "")
    return [*tags, name, *_discriminator_values(bare)]


def _discriminator_values(bare: Any) -> list[str]:
    if not _is_model(bare):
        return []
    literals = [
        field.annotation
        for field in bare.model_fields.values()
        if get_origin(field.annotation) is Literal
    ]
    return [str(value) for literal in literals for value in get_args(literal)]


def _below(annotation: Any, step: str | int) -> Any:
    """Type of what lies one step below a value of a type; Any if it is not known."""
    if _is_model(annotation):
        return _field(annotation, str(step))
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is dict:
        return arguments[1]
    if origin is tuple and isinstance(step, int) and arguments[1:] != (Ellipsis,):
        return arguments[step] if step < len(arguments) else Any
    return arguments[0] if origin in (list, tuple, set, frozenset) else Any


def _field(model: type[BaseModel], key: str) -> Any:
    for name, field in model.model_fields.items():
        if key in (name, field.alias):
            return field.annotation
    if model.model_config.get("extra") != "allow":
        return Any
    hints = get_type_hints(model, include_extras=True)
    return _below(_bare(hints.get("__pydantic_extra__")), key)

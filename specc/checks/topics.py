"""What devices are behind topics of ROS 2: messages, joints and frames fit their elements."""

from __future__ import annotations

from collections.abc import Iterator

from specc.analysis import Facts
from specc.analysis.plant import BoundElement, first_key
from specc.analysis.ros2 import (
    CALLS,
    MessageTypeMismatch,
    frames_of,
    part_of,
    published_value,
    takes_joints,
)
from specc.analysis.ros2_messages import JOINTS, short_message_type
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import counted, with_article
from specc.model.bindings import DIAGNOSTICS, PLANT
from specc.model.expr import Input
from specc.model.types import Type
from specc.source import Place


def topics_fit(facts: Facts) -> Iterator[Diagnostic]:
    """E0505, for a binding of ROS 2 whose kind does not suit its element."""
    for bound in facts.bindings:
        if bound.plant == "ros2" and (complaint := _kind_complaint(bound)):
            message, help = complaint
            yield Diagnostic(
                "E0505", message, bound.binding.place, related=(_type(bound),), help=help
            )


_OF_CALLS = ("part", "when_busy", "answer_within_s")
_OF_A_MODEL = ("sensors", "actuators", "camera", "image", "noise", "depth_noise")
"""Of bindings to parts of a model."""
_MOST_KEPT = 1000
"""Messages of a topic, of which the latest one counts."""


def _kind_complaint(bound: BoundElement) -> tuple[str, str] | None:
    """Why a binding does not suit its element, and a help text; None if it does."""
    name, binding = bound.element.name, bound.binding
    if binding.device == PLANT:
        return "nothing is known of a plant behind ROS 2 but what its devices report", "delete it"
    if binding.rate_hz is not None:
        return "messages have no rate: the latest one counts", "delete `rate`"
    if key := first_key(binding, _OF_A_MODEL):
        return f"`{key}` is for MuJoCo models", f"delete `{key}`"
    if bound.is_commanded and binding.max_gap_s is not None:
        why = f"`{name}` is commanded: `max_gap` is for what a device reports"
        return why, "delete `max_gap`"
    if binding.through and binding.field:
        why = f"`{name}` is a field of the message, and what a function makes of it"
        return why, "delete `field`, or `through`"
    if not binding.tf:
        return _call_complaint(bound) if binding.call[0] else _topic_complaint(bound)
    if bound.is_commanded:
        return f"`{name}` is commanded, and transforms are only read", "publish a pose on a topic"
    others = ("topic", *CALLS, "message", "part", "qos", "joints", "through", "field", *_OF_CALLS)
    if key := first_key(binding, others):
        return f"`{key}` says nothing of a transform of tf2", f"delete `{key}`"
    return None


def _topic_complaint(bound: BoundElement) -> tuple[str, str] | None:
    """Why a binding to a topic is wrong, and a help text; None if it is right."""
    name, binding = bound.element.name, bound.binding
    if not binding.topic:
        return f"`{name}` has no `topic`", "add `topic:`, e.g. `topic: /joint_states`"
    if not binding.message:
        return f"`{name}` has no `type`", "add `type:`, e.g. `type: sensor_msgs/JointState`"
    if key := first_key(binding, _OF_CALLS):
        why = f"`{key}` of `{name}` is for actions and services"
        return why, f"add `action:` or `service:`, or delete `{key}`"
    if binding.field and binding.joints:
        return f"`joints` of `{name}` are in fields that are known", "delete `field`"
    if binding.joints and not takes_joints(binding):
        return f"messages of type {binding.message} have no joints", "delete `joints`"
    qos = dict(binding.qos)
    if (qos.get("durability"), qos.get("reliability")) == ("transient_local", "best_effort"):
        why = "the last message of a `transient_local` topic goes to reliable readers only"
        return why, "delete `reliability: best_effort`"
    depth = int(qos.get("depth", 1))
    if not 0 < depth <= _MOST_KEPT:
        return f"a queue has no depth of {depth}", f"write `depth:` from 1 to {_MOST_KEPT}"
    return None


def _call_complaint(bound: BoundElement) -> tuple[str, str] | None:
    """Why a binding to an action or a service is wrong, and a help text; None if it is right."""
    name, binding = bound.element.name, bound.binding
    call = binding.call[0]
    assert call, "the caller knows that it is a part of one"
    parts, what = CALLS[call], with_article(call.replace("_", " "))
    known = parts.commanded if bound.is_commanded else (*parts.reported, parts.given_back)
    listed = ", ".join(filter(None, known))
    if other := first_key(binding, tuple(each for each in CALLS if each != call)):
        return f"`{name}` is a part of two: `{call}` and `{other}`", f"delete `{other}`"
    keys = ("topic", "qos") if takes_joints(binding) else ("topic", "qos", "joints")
    if key := first_key(binding, keys):
        return f"`{key}` is for topics, and `{name}` is a part of {what}", f"delete `{key}`"
    if not binding.part:
        return f"{what} has several parts", f"add `part:` with one of these: {listed}"
    if not binding.message:
        return f"`{name}` has no `type`", "add `type:`, e.g. `type: control_msgs/GripperCommand`"
    if binding.part not in known:
        verb = "commanded" if bound.is_commanded else "reported"
        why = f"`{name}` is {verb}, and the {binding.part} of {what} is not"
        return why, f"{verb} parts of {what} are {listed}"
    is_message = not (binding.part in ("status", "cancel") or _is_given_back(bound))
    if not is_message and (key := first_key(binding, ("through", "field"))):
        value = "what was commanded" if _is_given_back(bound) else "a word of its own"
        return f"`{name}` is {value}, and no message", f"delete `{key}`"
    return _time_complaint(bound)


def _time_complaint(bound: BoundElement) -> tuple[str, str] | None:
    """Why a part of an action or a service is bound in a wrong way as to when it comes, and a help
    text; None if it is right.
    """
    name, binding = bound.element.name, bound.binding
    call, _ = binding.call
    is_asked = call.endswith("_server") and binding.part == "request"
    if binding.when_busy and not (is_asked and call == "action_server"):
        return "`when_busy` says how goals of an action server come", "delete `when_busy`"
    if binding.answer_within_s and not (binding.part == "request" and not _is_given_back(bound)):
        return "`answer_within` is for requests", "write it at the binding of `request`"
    if call.endswith("_server") and binding.max_gap_s is not None:
        return f"`{name}` comes when somebody asks", "delete `max_gap`"
    if binding.part == "cancel" and binding.initial is not None and binding.initial.value:
        return f"`{name}` is `False` until a client cancels", "delete `init`"
    if is_asked and binding.initial is None:
        why = f"`{name}` has no value until somebody asks"
        return why, f'make it an "optional[{bound.element.type}]", or add `init:`'
    return None


def _is_given_back(bound: BoundElement) -> bool:
    """Whether an element is what the device of an action or a service has taken last."""
    call, part = bound.binding.call[0], bound.binding.part
    return bool(call and part == CALLS[call].given_back and not bound.is_commanded)


def calls_whole(facts: Facts) -> Iterator[Diagnostic]:
    """E0505: parts of a call have one type, and what others call is asked and answered."""
    calls: dict[tuple[str, str], list[BoundElement]] = {}
    for bound in facts.bindings:
        if bound.plant == "ros2" and bound.binding.call[0] and bound.binding.message:
            calls.setdefault(bound.binding.call, []).append(bound)
    for (kind, name), parts in calls.items():
        first, seen = parts[0], {bound.binding.part: bound for bound in parts[::-1]}
        answer = "status" if kind == "action_server" else "response"
        what, is_served = kind.replace("_", " "), kind.endswith("_server")
        for lacking in (p for p in ("request", answer) if is_served and p not in seen):
            yield Diagnostic(
                "E0505",
                f"the {what} {name} has no `{lacking}`: "
                + ("nobody can ask" if lacking == "request" else "nobody is answered"),
                first.binding.place,
                help=f"bind an element to `{kind}: {name}` with `part: {lacking}`",
            )
        for bound in parts:
            message = short_message_type(bound.binding.message)
            if message != short_message_type(first.binding.message):
                yield Diagnostic(
                    "E0505",
                    f"{name} is of type {first.binding.message} and of type "
                    f"{bound.binding.message}",
                    _place(bound),
                    related=(Related(first.binding.place, "the first one"),),
                    help="give all parts the same `type`",
                )
            elif is_served and bound.is_commanded and seen[bound.binding.part] is not bound:
                yield Diagnostic(
                    "E0505",
                    f"the {bound.binding.part} of {name} is bound twice",
                    bound.binding.place,
                    related=(Related(seen[bound.binding.part].binding.place, "the first one"),),
                    help="delete one of the two",
                )


def requests_passed_once(facts: Facts) -> Iterator[Diagnostic]:
    """E0505: a request is an event, and what sends it on in each period asks again and again."""
    requests = {
        (bound.binding.device, bound.element.name): bound
        for bound in _topics(facts)
        if bound.binding.call[0].endswith("_server") and bound.binding.part == "request"
    }
    for subsystem in facts.system.subsystems if requests else ():
        wires = facts.wires.wires_of(subsystem)
        ends = {wire.port.peer: wire.peer_name for wire in wires if wire.port.direction == "x"}
        for state in subsystem.states if len(subsystem.states) == 1 else ():
            for item in state.behaviour.assignments:
                value = item.value
                if not isinstance(value, Input):
                    continue
                bound = requests.get((ends.get(value.peer, ""), value.element))
                if bound is not None:
                    name = f"x.{value.peer}.{value.element}"
                    yield Diagnostic(
                        "E0505",
                        f"`{name}` is a request, and `{subsystem.qualified_name}` sends it again "
                        "in each period",
                        item.place,
                        related=(_type(bound),),
                        help=f"say at `{name}` that it is an event: "
                        f'`{{type: "{bound.element.type}", event: true}}`',
                    )


def calls_given_back(facts: Facts) -> Iterator[Diagnostic]:
    """E0505, E0521: one element commands a call, and what is given back is that, of its type."""
    topics = list(_topics(facts))
    commanded: dict[object, BoundElement] = {}
    for bound in topics:
        key = bound.binding.call, bound.binding.part
        if not bound.is_commanded or bound.binding.call[0] not in ("action", "service"):
            continue
        if (first := commanded.setdefault(key, bound)) is not bound:
            yield Diagnostic(
                "E0505",
                f"the {bound.binding.part} of {bound.binding.call[1]} is bound twice",
                bound.binding.place,
                related=(Related(first.binding.place, "the first one"),),
                help="send one of the two, or a record that has both as its fields",
            )
    for bound in topics:
        if not _is_given_back(bound):
            continue
        part, name, type_ = bound.binding.part, bound.binding.call[1], bound.element.type
        sender = commanded.get((bound.binding.call, part))
        if sender is None:
            message = f"`{bound.element.name}` gives back {part}s of {name}, and nobody sends any"
            help = f"bind a commanded element to {name} with `part: {part}`, or delete this"
            yield Diagnostic(
                "E0505", message, bound.binding.place, related=(_type(bound),), help=help
            )
        elif sender.element.type != type_:
            yield Diagnostic(
                "E0521",
                f"{type_} is not the {part} that `{sender.element.name}` commands",
                _place(bound),
                related=(_type(bound), _type(sender)),
                help=f'make it "{sender.element.type}"',
            )


def messages_fit(facts: Facts) -> Iterator[Diagnostic]:
    """E0511, E0521; a binding of the wrong kind is `topics_fit`'s matter."""
    for bound in _topics(facts):
        mismatch = part_of(bound.binding, bound.element.type, commanded=bound.is_commanded)
        if isinstance(mismatch, MessageTypeMismatch):
            place = _place(bound)
            yield Diagnostic(
                mismatch.code, mismatch.message, place, related=(_type(bound),), help=mismatch.help
            )


def joints_counted(facts: Facts) -> Iterator[Diagnostic]:
    """E0507: where messages name joints, there is a name for each number of the element."""
    for bound in _topics(facts):
        binding, type_ = bound.binding, bound.element.type
        part = part_of(binding, type_, commanded=bound.is_commanded)
        if isinstance(part, MessageTypeMismatch) or part.shape not in JOINTS:
            if binding.joints and binding.call[0] and not isinstance(part, MessageTypeMismatch):
                yield Diagnostic(
                    "E0505",
                    f"`{bound.element.name}` has no numbers of joints",
                    binding.place.below("joints"),
                    related=(_type(bound),),
                    help="delete `joints`",
                )
            continue
        wanted, given = _numbers_of(type_), len(binding.joints)
        if given != wanted:
            yield Diagnostic(
                "E0507",
                f"`{bound.element.name}` has {counted(wanted, 'number')}, and {given or 'no'} "
                f"{'joint is' if given == 1 else 'joints are'} named",
                binding.place.below("joints") if given else binding.place,
                related=(_type(bound),),
                help="name the joints in the order of the element: `joints: [NAME, ...]`",
            )


def _numbers_of(type_: Type) -> int:
    """How many numbers a value has; of a trajectory, each of its points for each of its fields."""
    return len(type_.components) or max(map(_numbers_of, type_.parts), default=1)


def frames_named(facts: Facts) -> Iterator[Diagnostic]:
    """E0521: frames of messages are compared by name."""
    ros2 = facts.system.plant.ros2 if facts.system.plant else None
    if ros2 is None:
        return
    known = dict(ros2.frames)
    for bound in _topics(facts):
        part = part_of(bound.binding, bound.element.type, commanded=bound.is_commanded)
        if isinstance(part, MessageTypeMismatch):
            continue
        message = short_message_type(bound.binding.message)
        reason = f"messages of type {message} say which frame they are in"
        if bound.binding.tf:
            reason = "tf2 has its own names of frames"
        for at, frame in frames_of(part, bound.element.type):
            if at and frame and frame not in known:
                yield Diagnostic(
                    "E0521",
                    f"{reason}, and frame `{frame}` has no name in ROS",
                    _place(bound),
                    related=(_type(bound),),
                    help=f"say under `ros2:` what it is called: `frames: {{{frame}: NAME}}`",
                )


def published_known(facts: Facts) -> Iterator[Diagnostic]:
    """E0521, for a published value that does not exist or has no type of messages."""
    plant = facts.system.plant
    for published in plant.published if plant else ():
        found: object = MessageTypeMismatch(
            "nobody can watch it: there is no node of ROS 2",
            "say under `plant` which node there is: `ros2: {node: NAME}`, or delete it",
            "E0521",
        )
        if plant is not None and plant.ros2 is not None:
            if published.name == DIAGNOSTICS:
                continue
            found = published_value(published, facts.system)
        if isinstance(found, MessageTypeMismatch):
            yield Diagnostic(found.code, found.message, published.place, help=found.help)


def _topics(facts: Facts) -> Iterator[BoundElement]:
    for bound in facts.bindings:
        if bound.plant == "ros2" and not _kind_complaint(bound):
            yield bound


def _place(bound: BoundElement) -> Place:
    return bound.binding.place.below("tf" if bound.binding.tf else "type")


def _type(bound: BoundElement) -> Related:
    return Related(bound.element.place, f"`{bound.element.type}`")

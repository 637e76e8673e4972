"""What a system says of ages: what outputs are computed from, and how old what is read may be."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Behind:
    """What an `output` of `subsystem` is computed from in some of its `states`.

    Inputs that are `held` count always, `fresh` ones only in steps in which they are new. Left out
    is what comes back to a buffer that it has passed, and what nobody measured; but where nothing
    measured is behind the output in any state, its age counts from where inputs were `computed`.
    """

    subsystem: str
    output: str
    states: tuple[str, ...]
    held: tuple[str, ...] = ()
    fresh: tuple[str, ...] = ()
    computed: bool = False


@dataclass(frozen=True, slots=True)
class MaxAge:
    """How old `element` may be, in s, where `subsystem` reads it by that `name`.

    That is in steps that begin in a state of `asked`, whose conditions depend on it, or lead to one
    of `used`, whose functions do; if `fresh`, in those alone in which it is new. Its age counts
    from where it was `computed`, or from a measurement if there is one.
    """

    subsystem: str
    element: str
    name: str
    most_s: float
    asked: tuple[str, ...] = ()
    used: tuple[str, ...] = ()
    fresh: bool = False
    computed: bool = False


@dataclass(frozen=True, slots=True)
class MaxCommandAge:
    """How old an `output` of `subsystem` may be, in s, when it takes effect as `device` element.

    Its age counts from where it was `computed`, or from a measurement if there is one.
    """

    subsystem: str
    output: str
    most_s: float
    device: str
    computed: bool = False


@dataclass(frozen=True, slots=True)
class AgeRules:
    """All of a system; it has them where somebody asks for an age or limits one."""

    behind: tuple[Behind, ...] = ()
    limits: tuple[MaxAge, ...] = ()
    commands: tuple[MaxCommandAge, ...] = ()

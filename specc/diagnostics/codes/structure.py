"""E04xx and W04xx: agents, subsystems, devices and the buffers between them (2.1, 2.2, 3)."""

from specc.diagnostics.code import Code

_IDLE = "rate: 10 Hz, behaviours: {idle: {terminal: never}}, states: {S0: idle}, initial_state: S0"
_EFFECTOR = f"    virtual_effectors:\n      m: {{{_IDLE}}}\n"
_CONTROL = f"    control: {{{_IDLE}}}\n"
_GRIPPER = f"virtual_effectors:\n  g: {{y: {{c: {{closed: bool}}}}, {_IDLE}}}\n"
_MEASURED = "{m_m: 'vector[2, rad]', F_m: 'wrench[E]'}"
_EYE = "real_receptors: {eye: {y: {d: int}}}\n"

CODES = (
    Code(
        "E0401",
        "connection that the structure forbids",
        "Virtual effectors and receptors never talk to each other, agents talk only through their "
        "control subsystems, and a control subsystem does not drive real effectors itself (2.1).",
        "virtual_effectors: {m: {x: {k: {seen: bool}}}} # k is a virtual receptor\n",
        "control: {x: {k: {seen: bool}}, y: {m: {seen: bool}}}\n"
        "virtual_effectors: {m: {x: {c: {seen: bool}}}}\n",
        "agent",
    ),
    Code(
        "E0404",
        "element missing at one end",
        "Connected buffers have exactly the same structure (section 3). One end has an element "
        "that the other lacks.",
        "virtual_effectors: {m: {y: {c: {n: int}}}}\n",
        "virtual_effectors: {m: {y: {c: {n: int}}}}\ncontrol: {x: {m: {n: int}}}\n",
        "agent",
    ),
    Code(
        "E0405",
        "types differ between two ends",
        "Connected buffers have exactly the same structure (section 3). The element has another "
        "type, unit or frame at one end than at the other.",
        "virtual_effectors: {m: {y: {c: {T: 'pose[B, E]'}}}}\n"
        "control: {x: {m: {T: 'pose[K, E]'}}}\n",
        "virtual_effectors: {m: {y: {c: {T: 'pose[B, E]'}}}}\n"
        "control: {x: {m: {T: 'pose[B, E]'}}}\n",
        "agent",
    ),
    Code(
        "E0406",
        "device commanded from two sides",
        "A virtual effector owns its real effectors. Were a device commanded by two subsystems, "
        "which command it obeys would depend on chance. Several virtual receptors may read one "
        "real receptor.",
        f"virtual_effectors:\n  g: {{uses: [m], x: {{E: {_MEASURED}}}, {_IDLE}}}\n",
        f"virtual_effectors:\n  g: {{x: {{c: {{n: int}}}}, {_IDLE}}}\n"
        "control: {y: {g: {n: int}}}\n",
        "agent",
    ),
    Code(
        "E0407",
        "kind differs from the structure",
        "The declared kind of an agent (2.2) is not that of its structure: C always, E with "
        "effectors, R with receptors, T if it talks to other agents.",
        "kind: CERT\n",
        "kind: CER\n",
        "agent",
    ),
    Code(
        "E0408",
        "useless agent",
        "Of the eight kinds of agents seven are useful (2.2). One that has only a control "
        "subsystem and talks to nobody has no influence and no knowledge.",
        f"agents:\n  two:\n{_CONTROL}",
        f"agents:\n  two:\n{_CONTROL}{_EFFECTOR}",
        "file",
    ),
    Code(
        "E0409",
        "rates without a common timeline",
        "The compiler turns rates into a timeline that repeats after the least common multiple of "
        "the periods. Rates that hardly go together make it longer than 100000 base ticks.",
        "virtual_receptors: {k: {rate: 29.97 Hz}}\n",
        "virtual_receptors: {k: {rate: 25 Hz}}\n",
        "agent",
    ),
    Code(
        "E0411",
        "two subsystems of one name",
        "Within an agent buffers are named after the subsystem at their other end, so its virtual "
        "effectors and virtual receptors have different names; `c` is the control subsystem.",
        f"agents:\n  two:\n{_CONTROL}{_EFFECTOR}    virtual_receptors:\n      m: {{{_IDLE}}}\n",
        f"agents:\n  two:\n{_CONTROL}{_EFFECTOR}    virtual_receptors:\n      k: {{{_IDLE}}}\n",
        "file",
    ),
    Code(
        "E0412",
        "safe output that may fail",
        "What a device gets when a run ends must be there whatever has happened. An operator may "
        "raise an exception, and what the device reports may never have come, so a `safe` that "
        "asks for them says with `otherwise` what is sent if it fails: a constant that no "
        "operator computes.",
        "real_effectors:\n  m: {x: {c_d: {type: 'vector[2, A]', safe: 'm_m * 1[A/rad]'}}}\n",
        "real_effectors:\n"
        "  m:\n"
        "    x:\n"
        "      c_d:\n"
        "        type: 'vector[2, A]'\n"
        "        safe: {is: 'm_m * 1[A/rad]', otherwise: '[0, 0]'}\n",
        "agent",
    ),
)

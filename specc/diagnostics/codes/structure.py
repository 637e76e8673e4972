"""E04xx and W04xx: agents, subsystems, devices and the buffers between them (2.1, 2.2, 3)."""

from specc.diagnostics.code import Code

CODES = (
    Code(
        "E0401",
        "connection that the structure forbids",
        "Virtual effectors and receptors never talk to each other, agents talk only through their "
        "control subsystems, and a control subsystem does not drive real effectors itself (2.1).",
        "virtual_effectors: {m: {x: {k: {O_c: real}}}}    # k is a virtual receptor\n",
        "control: {x: {k: {O_c: real}}, y: {m: {O_c: real}}}\n",
    ),
    Code(
        "E0402",
        "agent without a control subsystem",
        "Every agent has exactly one control subsystem; it is what makes the others an agent "
        "(2.1).",
        "agents: {irp: {virtual_effectors: {m: {}}}}\n",
        "agents: {irp: {control: {}, virtual_effectors: {m: {}}}}\n",
    ),
    Code(
        "E0403",
        "buffer without another end",
        "A buffer is one end of a connection. The subsystem or device at the other end has no "
        "buffer that faces this one, so nothing would ever arrive, or nobody would ever read it.",
        "m: {y: {c: {T_c: real}}}\ncontrol: {}\n",
        "m: {y: {c: {T_c: real}}}\ncontrol: {x: {m: {T_c: real}}}\n",
    ),
    Code(
        "E0404",
        "element missing at one end",
        "Connected buffers have exactly the same structure (section 3). One end has an element "
        "that the other lacks.",
        "m: {y: {c: {T_c: real, F_c: real}}}\ncontrol: {x: {m: {T_c: real}}}\n",
        "m: {y: {c: {T_c: real, F_c: real}}}\ncontrol: {x: {m: {T_c: real, F_c: real}}}\n",
    ),
    Code(
        "E0405",
        "types differ between two ends",
        "Connected buffers have exactly the same structure (section 3). The element has another "
        "type, unit or frame at one end than at the other.",
        'm: {y: {c: {T_c: "pose[B, E]"}}}\ncontrol: {x: {m: {T_c: "pose[K, E]"}}}\n',
        'm: {y: {c: {T_c: "pose[B, E]"}}}\ncontrol: {x: {m: {T_c: "pose[B, E]"}}}\n',
    ),
    Code(
        "E0406",
        "device commanded from two sides",
        "A virtual effector owns its real effectors. Were a device commanded by two subsystems, "
        "which command it obeys would depend on chance. Several virtual receptors may read one "
        "real receptor.",
        "virtual_effectors: {m: {uses: [arm]}, g: {uses: [arm]}}\n",
        "virtual_effectors: {m: {uses: [arm]}, g: {uses: [gripper]}}\n",
    ),
    Code(
        "E0407",
        "kind differs from the structure",
        "The declared kind of an agent (2.2) is not that of its structure: C always, E with "
        "effectors, R with receptors, T if it talks to other agents.",
        "irp: {kind: CERT, control: {}, virtual_effectors: {m: {}}}\n",
        "irp: {kind: CE, control: {}, virtual_effectors: {m: {}}}\n",
    ),
    Code(
        "E0408",
        "useless agent",
        "Of the eight kinds of agents seven are useful (2.2). One that has only a control "
        "subsystem and talks to nobody has no influence and no knowledge.",
        "agents: {idle: {control: {}}}\n",
        "agents: {idle: {control: {x: {other: {n: int}}}}, other: {...}}\n",
    ),
    Code(
        "E0409",
        "rates without a common timeline",
        "The compiler turns rates into a timeline that repeats after the least common multiple of "
        "the periods. Rates that hardly go together make it longer than 100000 base ticks.",
        "m: {rate: 500 Hz}\nk: {rate: 29.97 Hz}\n",
        "m: {rate: 500 Hz}\nk: {rate: 25 Hz}\n",
    ),
    Code(
        "W0410",
        "device that nobody uses",
        "No subsystem has a buffer to or from this device. A virtual effector or receptor uses "
        "the device of its own name, or those that it lists under `uses:`.",
        "real_receptors: {k: {y: {I: real}}}\n",
        "real_receptors: {k: {y: {I: real}}}\nvirtual_receptors: {k: {x: {R: {I: real}}}}\n",
    ),
    Code(
        "E0411",
        "two subsystems of one name",
        "Within an agent buffers are named after the subsystem at their other end, so its virtual "
        "effectors and virtual receptors have different names; `c` is the control subsystem.",
        "virtual_effectors: {m: {...}}\nvirtual_receptors: {m: {...}}\n",
        "virtual_effectors: {m: {...}}\nvirtual_receptors: {k: {uses: [m], ...}}\n",
    ),
)

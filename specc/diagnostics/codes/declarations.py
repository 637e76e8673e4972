"""E0205 to E0222: what files declare, and how the parts of a subsystem refer to each other."""

from textwrap import fill

from specc.diagnostics.code import Code


def _lets(count: int) -> str:
    lets = ", ".join(f"a{number}: a{number - 1} + n" for number in range(1, count))
    text = fill(f"let: {{a0: n, {lets}}}", 90, subsequent_indent="  ")
    return (
        f"memory: {{n: {{type: int, init: 0}}}}\n{text}\n"
        f"functions: {{keep: {{n: a{count - 1}}}}}\n"
        "behaviours: {idle: {functions: [hold, sense, keep]}}\n"
    )


_REPEATED = """\
agents:
  irp:
    control:
      behaviours: {command: {functions: [command], terminal: always}}
      transitions: [[S0, terminal, always, S0]]
"""

CODES = (
    Code(
        "E0205",
        "name defined twice",
        "Two definitions of one kind share a name: in one file, or in a file and one that it uses. "
        "Which of the two is meant could only be guessed.",
        "specc: 1\nsystem: demo\nuse: [lib/frames.yaml] # defines B\nframes: {B: robot base}\n",
        "specc: 1\nsystem: demo\nuse: [lib/frames.yaml] # defines B\nframes: {E: end-effector}\n",
    ),
    Code(
        "E0206",
        "let defined by itself",
        "A let depends on its own value, directly or through others. Within a period there is no "
        "order in which the values could be computed; the value of the previous period is kept in "
        "memory.",
        "let: {a: b + 1, b: a + 1}\n",
        "memory: {a_p: {type: int, init: 0}}\nlet: {b: a_p + 1}\n",
        "subsystem",
    ),
    Code(
        "E0207",
        "file uses itself",
        "Files that use each other in a circle have no order in which their definitions could be "
        "read. What both need belongs in a third file.",
        "specc: 1\nsystem: demo\nuse: [spec.yaml] # this file\n",
        "specc: 1\nsystem: demo\nuse: [lib/frames.yaml]\n",
    ),
    Code(
        "E0208",
        "no such file or directory",
        "A path under `files:` leads nowhere. Paths are relative to the file that names them.",
        "files: {arm: plants/armm.xml}\n",
        "files: {arm: plants/arm.xml}\n",
        "file",
    ),
    Code(
        "E0210",
        "unknown parameter",
        "A reused description is given a value for a parameter that it does not have.",
        "virtual_effectors: {g: {use: lib/gripper.yaml, with: {tolerance: '0.001[m]', d: 0}}}\n",
        "virtual_effectors: {g: {use: lib/gripper.yaml, with: {tolerance: '0.001[m]'}}}\n",
        "agent",
    ),
    Code(
        "E0211",
        "parameter without a value",
        "A reused description has a parameter that its user gives no value. Parameters have no "
        "default: what they are for is to be decided where the description is used.",
        "virtual_effectors: {g: {use: lib/gripper.yaml}}\n",
        "virtual_effectors: {g: {use: lib/gripper.yaml, with: {tolerance: '0.001[m]'}}}\n",
        "agent",
    ),
    Code(
        "E0212",
        "unknown condition",
        "A behaviour or a row names a condition that is not declared. Rows name initial "
        "conditions, behaviours terminal and error conditions; `always` and `never` are known "
        "everywhere.",
        "conditions: {terminal: {commanded: fresh(x.c.v)}}\n"
        "behaviours: {idle: {terminal: comanded}}\n",
        "conditions: {terminal: {commanded: fresh(x.c.v)}}\n"
        "behaviours: {idle: {terminal: commanded}}\n",
        "subsystem",
    ),
    Code(
        "E0214",
        "unknown target",
        "A function assigns something that is neither an element of an output buffer "
        "(`y.peer.element`) nor a memory element (its name).",
        'memory: {d_p: {type: "real[rad]", init: 0}}\n'
        "functions: {keep: {d_pp: x.c.d}}\n"
        "behaviours: {idle: {functions: [hold, sense, keep]}}\n",
        'memory: {d_p: {type: "real[rad]", init: 0}}\n'
        "functions: {keep: {d_p: x.c.d}}\n"
        "behaviours: {idle: {functions: [hold, sense, keep]}}\n",
        "subsystem",
    ),
    Code(
        "E0215",
        "unknown function",
        "A behaviour names a transition function that is not declared.",
        "functions: {sense: {y.c.q: 0}}\nbehaviours: {idle: {functions: [hold, sens]}}\n",
        "functions: {sense: {y.c.q: 0}}\nbehaviours: {idle: {functions: [hold, sense]}}\n",
        "subsystem",
    ),
    Code(
        "E0216",
        "unknown behaviour",
        "A state names a behaviour that is not declared.",
        "behaviours: {idle: {terminal: always}}\nstates: {S0: idel}\n",
        "behaviours: {idle: {terminal: always}}\nstates: {S0: idle}\n",
        "subsystem",
    ),
    Code(
        "E0217",
        "unknown state",
        "A row, `initial_state` or the cycle of a task names a state that is not in the state "
        "table.",
        "states: {S0: idle}\ninitial_state: S0_\n",
        "states: {S0: idle}\ninitial_state: S0\n",
        "subsystem",
    ),
    Code(
        "E0218",
        "unknown peer",
        "A buffer is named after the subsystem at its other end: `c` for the control subsystem of "
        "the agent, `E` or `R` for the device, in a control subsystem the name of a virtual "
        "effector, a virtual receptor or another agent. Under `uses:` stand real effectors or "
        "receptors of the agent. Nothing has this name.",
        "virtual_effectors: {m: {x: {cc: {n: int}}}}\ncontrol: {y: {m: {n: int}}}\n",
        "virtual_effectors: {m: {x: {c: {n: int}}}}\ncontrol: {y: {m: {n: int}}}\n",
        "agent",
    ),
    Code(
        "E0219",
        "file describes nothing to reuse",
        "A part is taken from a file that does not describe such a part: a virtual effector, "
        "virtual receptor or control subsystem needs a file with `subsystem:`, an agent one with "
        "`agent:`.",
        "virtual_effectors: {g: {use: lib/frames.yaml}}\n",
        "virtual_effectors: {g: {use: lib/gripper.yaml, with: {tolerance: '0.001[m]'}}}\n",
        "agent",
    ),
    Code(
        "E0220",
        "unknown subsystem",
        "The task counts the cycles of a subsystem that does not exist. A subsystem is named by "
        "its agent and its own name; the control subsystem is always called `c`.",
        _REPEATED + "task: {cycle: {of: irp.control, from: S0, to: S0}}\n",
        _REPEATED + "task: {cycle: {of: irp.c, from: S0, to: S0}}\n",
        "file",
    ),
    Code(
        "E0221",
        "name with two meanings",
        "In expressions memory elements, lets, constants, parameters and files are called by "
        "their bare names, beside the words of the language (`x`, `elapsed`, `near`, ...). One "
        "name for two of them could be read either way. Operators and types do not take words of "
        "the language either.",
        "memory: {q: {type: int, init: 0}}\nlet: {q: 2 * x.c.d}\n",
        "memory: {q_p: {type: int, init: 0}}\nlet: {q: 2 * x.c.d}\n",
        "subsystem",
    ),
    Code(
        "E0222",
        "lets too deep",
        "More than a hundred lets depend on each other in a row. Nobody can read that, and the "
        "compiler follows them one inside the other.",
        _lets(120),
        _lets(12),
        "subsystem",
    ),
)

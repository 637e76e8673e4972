"""A small system in two files, and a cursor in it: `|` marks a place in a stretch of its text."""

from pathlib import Path

from specc.tools.lsp.project import Project

SYSTEM = """\
specc: 1
system: arm
frames: {B: base of the arm, E: "end-effector 🦾"}
types:
  Mode: {type: "enum[go, halt]", title: what is commanded}
  Joints: vector[2, rad]
  Grip: {fields: {width: "real[m]", force: "real[N]"}, python: "arm:Grip", title: fingers}
constants:
  limit: {is: "0.5[rad]", title: largest step}
operators:
  DK: {signature: "(q: Joints) -> pose[B, E]", python: "arm:dk", eq: 15, title: direct kinematics}
  GR: {signature: "() -> Grip", python: "arm:grip"}
agents:
  irp:
    real_effectors:
      m: {x: {q_d: Joints}, y: {q_m: Joints}}
      g: {x: {d_d: "real[m]"}, y: {d_m: "real[m]"}}
    virtual_effectors:
      m:
        rate: 10 Hz
        x:
          c: {q_d: {type: Joints, title: desired joints}, mode: Mode}
          E: {q_m: Joints}
        y:
          c: {X_c: "pose[B, E]"}
          E: {q_d: Joints}
        memory:
          q_p: {type: Joints, init: x.E.q_m, title: previous joints, eq: 7}
          grip: {type: Grip, init: GR()}
        let:
          T_c: {is: "DK(x.E.q_m)", eq: 24, title: where the hand is}
          near_goal: "near(q_p, x.E.q_m, limit) and grip.width < 0.1[m]"
        conditions:
          initial:
            going: "fresh(x.c.mode) and x.c.mode in {go}"
            resting: "not fresh(x.c.mode) or x.c.mode == halt"
          terminal: {reached: "near_goal and all(v < 1[rad] for v in q_p)"}
        functions:
          hold: {title: stay, y.E.q_d: q_p, y.c.X_c: T_c, grip: GR()}
          move: {y.E.q_d: x.c.q_d, y.c.X_c: T_c, q_p: x.c.q_d}
        behaviours:
          idle: {functions: [hold], terminal: always}
          motion: {functions: [move], terminal: reached}
        states: {S0: idle, S1: motion}
        initial_state: S0
        transitions:
          - [S0, terminal, going, S1]
          - [S0, terminal, resting, S0]
          - {from: S1, cause: terminal, when: always, to: S0}
      g: {use: lib/fingers.yaml, with: {tolerance: "0.001[m]"}}
    control:
      rate: 10 Hz
      x: {m: {X_c: "pose[B, E]"}, g: {d_c: "real[m]"}}
      y: {m: {q_d: Joints, mode: Mode}, g: {d_d: "real[m]"}}
      memory: {q_home: {type: Joints, init: "[0, 1[rad]]"}}
      functions: {command: {y.m.q_d: q_home, y.m.mode: go, y.g.d_d: 0}}
      behaviours: {work: {functions: [command], terminal: always}}
      states: {S0: work}
      initial_state: S0
      transitions: [[S0, terminal, always, S0]]
"""
LIBRARY = """\
specc: 1
parameters: {tolerance: "real[m]"}
subsystem:
  rate: 10 Hz
  x: {c: {d_d: "real[m]"}, E: {d_m: "real[m]"}}
  y: {c: {d_c: "real[m]"}, E: {d_d: "real[m]"}}
  memory: {d_p: {type: "real[m]", init: x.E.d_m}}
  conditions:
    initial: {moved: "not near(d_p, x.E.d_m, tolerance)", still: "near(d_p, x.E.d_m, tolerance)"}
  functions: {follow: {y.c.d_c: d_p, y.E.d_d: d_p, d_p: x.E.d_m}}
  behaviours: {idle: {functions: [follow], terminal: always}}
  states: {S0: idle}
  initial_state: S0
  transitions: [[S0, terminal, moved, S0], [S0, terminal, still, S0]]
"""


def write(folder: Path) -> tuple[str, str]:
    """Put both files into a folder; the paths of the system and the library."""
    system, library = folder / "arm.yaml", folder / "lib" / "fingers.yaml"
    library.parent.mkdir()
    system.write_text(SYSTEM)
    library.write_text(LIBRARY)
    return str(system), str(library)


def opened(folder: Path) -> tuple[Project, str, str]:
    """A project with both files written and the system open."""
    system, library = write(folder)
    project = Project((str(folder),))
    project.put(system, SYSTEM)
    for root in project.find_roots(system, search=True):
        project.analyse(root)
    return project, system, library


def place(text: str, marked: str) -> int:
    """The offset of the `|` in `marked`, which stands once in the text but for the mark."""
    before, after = marked.split("|")
    assert text.count(before + after) == 1, f"{marked} stands {text.count(before + after)} times"
    return text.index(before + after) + len(before)


def edited(path: Path, text: str) -> tuple[Project, str]:
    """A project of one file that is open in an editor, and its path."""
    path.write_text(text)
    project = Project((str(path.parent),))
    project.put(str(path), text)
    project.analyse(str(path))
    return project, str(path)

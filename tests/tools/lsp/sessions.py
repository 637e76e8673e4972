"""What somebody types into the flagship, in several places: where, what, and what is wanted."""

from tests.house.tree import ROOT

FLAGSHIP = ROOT / "specs/irp_picking.yaml"
SESSIONS: list[tuple[str, str, dict[str, str]]] = [
    (
        "          terminal:\n            pose_reached:\n              eq: 5",
        "            stopped: {eq: 10, when: fresh(x.c.b) and any(v == s for v in x.c.b)}",
        {"fresh(": "x", "x.": "c", "x.c.": "b", "and an": "any", "v == ": "s", "10, w": "when"},
    ),
    (
        "          - [S0,    terminal, p2p_commanded,     S1]",
        "          - [S1, terminal, force_commanded, S2]",
        {"- [": "S0", "[S1, ": "terminal", "terminal, ": "idle_commanded", "commanded, ": "S2"},
    ),
    (
        "          # position-force control: Fig. 13",
        "          watch: {title: new, r_p: r_d, y.c.T_c: T_c, m_d: held.c_d}",
        {"new, r": "r_p", "r_p: r": "r_d", "y": "y.c.T_c", "y.c.T_c: T": "T_c", "held.": "c_d"},
    ),
    (
        "        initial_state: S0\n        transitions: # Table 4",
        "          S3: {behaviour: p2p, title: New}",
        {"{b": "behaviour", "behaviour: ": "idle", "behaviour: p": "p2p"},
    ),
    (
        "        conditions:\n          initial:\n            idle_commanded",
        '          far: {is: "norm(position(T_c) - position(T_g)) > 0.1[m]", title: far away}',
        {'"no': "norm", "position(T_": "T_c", "0.1[": "m"},
    ),
    (
        "        let:\n          q_c: {is: MJ",
        '          f_p: {type: "wrench[E]", init: "[0, 0, 0, 0, 0, 0]"}',
        {"{": "type", '"w': "wrench", "wrench[": "B", ", i": "init"},
    ),
]
"""Above which line, the line itself, and what is proposed first behind some of its beginnings."""


def typed(before: str, line: str, size: int) -> tuple[str, int]:
    """The flagship with the beginning of a line above another one, and where the beginning ends."""
    text = FLAGSHIP.read_text()
    start = text.index(before)
    return f"{text[:start]}{line[:size]}\n{text[start:]}", start + size

"""E090x and W090x: comments and settings that decide which findings are shown."""

from specc.diagnostics.code import Code

_SPEC = """\
specc: 1
system: demo
agents:
  a:
    control:
      rate: 10 Hz
      memory: {spare: {type: int, init: 0}}%s
      behaviours: {idle: {terminal: never}}%s
      states: {S0: idle}
      initial_state: S0
    virtual_effectors:
      m:
        rate: 10 Hz
        behaviours: {idle: {terminal: never}}
        states: {S0: idle}
        initial_state: S0
"""
_HELD_BACK = _SPEC % (" # specc: ignore[W0611] for the second robot", "")

CODES = (
    Code(
        "W0901",
        "ignore comment that ignores nothing",
        "There is no finding of this code on the line that the comment is about. What it was "
        "written for is mended, and it would hide the next one.",
        _SPEC
        % (" # specc: ignore[W0611] for the second robot", " # specc: ignore[W0611] as above"),
        _HELD_BACK,
    ),
    Code(
        "E0902",
        "ignore comment without a reason",
        "A comment that holds a finding back says why, so that a reviewer can judge it and "
        "somebody can delete it once the reason is gone. Without one it has no effect.",
        _SPEC % (" # specc: ignore[W0611]", ""),
        _HELD_BACK,
    ),
    Code(
        "E0903",
        "comment to specc not understood",
        "A comment that begins with `specc:` speaks to specc, and this one does not say "
        "`ignore[CODE, ...] reason` with codes that exist. Silently it would have no effect.",
        _SPEC % (" # specc: ignore W0611 for the second robot", ""),
        _HELD_BACK,
    ),
    Code(
        "E0904",
        "error cannot be ignored",
        "From a specification with an error no code can be generated, so nothing can be gained "
        "by not hearing of it. Comments and settings hold back warnings only.",
        _SPEC % (" # specc: ignore[E0601] for the second robot", ""),
        _HELD_BACK,
    ),
    Code(
        "E0905",
        "settings not understood",
        "The section `[tool.specc]` of the nearest pyproject.toml has a key that does not exist, a "
        "value of another kind than its key takes, or a code that no finding has; or the file is "
        "not TOML.",
        "$ printf '[tool.specc]\\nstrct = true\\n' > pyproject.toml\n$ specc validate demo.yaml",
        "$ printf '[tool.specc]\\nstrict = true\\n' > pyproject.toml\n$ specc validate demo.yaml",
    ),
)

"""`specc/analysis/reads.py` knows what an expression depends on, directly or through lets."""

import ast
from pathlib import Path

SPECC = Path(__file__).resolve().parents[2] / "specc"
ANSWER, NODE = "analysis/reads.py", "model/expr.py"
LANGUAGE = {
    "lang/errors.py": "where a name in a message comes from",
    "lang/evaluate.py": "its value",
    "lang/functions.py": "the let that a question about the time of a mode stands for",
    "lang/names.py": "what a name is",
    "lang/show.py": "its text",
    "resolve/modes.py": "the modes whose time is asked for",
    "resolve/uses.py": "which definition it names, for editors",
}
VALUES = {
    "lower/subsystem.py": "its name in generated code",
    "lower/terms.py": "its term",
    "proof/clock.py": "when time turns it",
    "proof/numbering.py": "its value number",
    "search/example.py": "the parts to which a situation gives values, fields of records too",
    "search/search.py": "which of these parts have to change for a wanted value",
    "proof/solver/solver.py": "its term of the solver",
    "proof/translate.py": "its formula",
    "tools/diff/equivalence.py": "its meaning in another version",
    "tools/explore/partial.py": "its value where others are known",
    "tools/explore/concrete.py": "whether the value of a vector is plain",
    "tools/explore/timing.py": "comparisons of time with values that are followed",
    "tools/why/moment.py": "what was read, lets included, in the order in which it is told",
    "tools/why/reasons.py": "why it has its value",
}
FACTS = {
    "analysis/machine.py": "the let that is the time of a mode",
    "checks/conditions.py": "which parts of it are constant",
    "analysis/path_conditions.py": "what holds where a part of it is computed",
    "analysis/value_ranges.py": "between which numbers it lies",
    "analysis/suspicious_expressions.py": "where it was written",
    "analysis/reaching.py": "which definitions give it its value",
    "checks/usage.py": "whether it is used",
    "checks/states.py": "which arrivals make it true",
    "tools/doc/formulas.py": "how it is set in a document",
    "tools/doc/equations.py": "whether a document writes it out where it is used",
    "tools/graph/machine.py": "its box in a drawing",
}
"""Which other modules look through lets, and for what."""


def test_no_other_module_looks_through_lets() -> None:
    found = set()
    for module in SPECC.rglob("*.py"):
        text = module.read_text(encoding="utf-8")
        nodes = ast.walk(ast.parse(text)) if "LetRef" in text else ()
        if any("LetRef" in (getattr(node, "attr", ""), getattr(node, "id", "")) for node in nodes):
            found.add(module.relative_to(SPECC).as_posix())
    assert found - {NODE} == {ANSWER, *LANGUAGE, *VALUES, *FACTS}

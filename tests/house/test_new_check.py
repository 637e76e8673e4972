"""A check takes a function and its line in the list, the page of its code, and a case."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.house.scratch import copied, in_copy

COPIED = (
    "specc",
    "pyproject.toml",
    "docs/diagnostics.md",
    "tests/conftest.py",
    "tests/seeds.py",
    "tests/cases/structure",
    "tests/checks/test_cases.py",
    "tests/commands.py",
    "tests/compiled.py",
    "tests/memory.py",
    "tests/corpus.py",
    "tests/diagnostics",
    "tests/docs",
    "tests/tools/fmt/layout.py",
    "tests/tools/graph/laws.py",
    "tests/witness/shown.py",
)

CHECK = '''

def rates_possible(facts: Facts) -> Iterator[Diagnostic]:
    """W0489, at the rate of a subsystem."""
    for subsystem in facts.subsystems:
        if subsystem.rate_hz > 10_000:
            place = subsystem.place.below("rate")
            yield Diagnostic("W0489", f"{_rate(subsystem)} is a lot", place, help="lower the rate")
'''
PAGE = """\
# W0489: rate beyond 10 kHz

No robot is stepped that often.

Refused in an agent:

```yaml
control: {rate: 20 kHz}
```

Accepted in an agent:

```yaml
control: {rate: 1 kHz}
```
"""
CASE = """\
specc: 1
system: demo
agents:
  a:
    control:
      rate: 20 kHz
      x: {outside: {d: real}}
      functions: {keep: {}}
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return copied(tmp_path_factory.mktemp("copy"), *COPIED)


@pytest.mark.long
def test_a_check_its_page_and_its_case_are_all_there_is_to_write(copy: Path) -> None:
    module, page = copy / "specc/checks/timing.py", copy / "specc/diagnostics/codes/W0489.md"
    case = copy / "tests/cases/structure/W0489-rate.yaml"
    module.write_text(module.read_text("utf-8") + CHECK, "utf-8")
    checks = copy / "specc/checks/__init__.py"
    line = "    timing.rates_meet,\n"
    listed = checks.read_text("utf-8")
    assert line in listed
    checks.write_text(listed.replace(line, f"{line}    timing.rates_possible,\n"), "utf-8")
    page.write_text(PAGE, "utf-8")
    case.write_text(CASE, "utf-8")
    tests = ["tests/checks/test_cases.py", "tests/diagnostics/test_codes.py"]
    tests.append("tests/diagnostics/test_examples.py")
    chosen = "W0489 or test_codes"
    done = in_copy(copy, "pytest", "-q", "-k", chosen, *tests, SPECC_UPDATE_CASES="1")
    assert done.returncode == 0, done.stdout
    assert "warning[W0489]: 20000 Hz is a lot" in case.read_text("utf-8")
    assert in_copy(copy, "specc", "explain", "W0489").stdout.startswith("W0489 (warning): rate")

"""Parameters of tests with many cases, of which most are long; and the seeds of random tests.

Seeds are fixed, or fresh: those follow from SPECC_SEED, which is any text. .ci/run takes the digest
of the tree that is tested. A seed that has failed joins the fixed ones of its test.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Iterable, Sequence
from hashlib import sha256
from typing import Any

import pytest
from hypothesis import given, settings

from tests.memory import settle

VARIABLE = "SPECC_SEED"
TEXT = os.environ.get(VARIABLE, "")
SEED = int(sha256(TEXT.encode()).hexdigest()[:7], 16) if TEXT else None
"""What random numbers of this run begin with; none where they are the same in every run."""
FIRST = 1000 if SEED is None else SEED


class Seeds(Sequence[int]):
    """The seeds that one test tries; it knows which one was looked at last."""

    now: int | None = None

    def __init__(self, seeds: Iterable[int]) -> None:
        self._seeds = tuple(seeds)

    def __len__(self) -> int:
        return len(self._seeds)

    def __getitem__(self, index: Any) -> Any:
        settle()
        self.now = self._seeds[index]
        return self.now


def blocks(fixed: Iterable[int], *, long: int, each: int, also: Iterable[int] = ()) -> list[Any]:
    """Parameters of a random test: the fixed seeds, and `long` others, `each` of a test.

    Long are those that are `also` fixed, too.
    """
    more = Seeds(also)
    others = [
        range(FIRST + begin, FIRST + min(begin + each, long)) for begin in range(0, long, each)
    ]
    return [
        pytest.param(Seeds(fixed), id="fixed"),
        *([pytest.param(more, id="also fixed", marks=pytest.mark.long)] if len(more) else ()),
        *(pytest.param(Seeds(s), id=f"{s.start}-{s[-1]}", marks=pytest.mark.long) for s in others),
    ]


def short(values: Iterable[Any], *places: int) -> list[Any]:
    """Parameters of which `make test` has those at the places, and the long tests all others."""
    return [
        pytest.param(
            *(value if isinstance(value, tuple) else (value,)),
            marks=() if place in places else pytest.mark.long,
        )
        for place, value in enumerate(values)
    ]


def drawn(*strategies: Any, few: int, many: int) -> Callable[[Callable[..., None]], Any]:
    """A random test whose arguments Hypothesis draws: a `few` examples, or `many` if it is long."""

    def of(test: Callable[..., None]) -> Any:
        @pytest.mark.parametrize("examples", [few, pytest.param(many, marks=pytest.mark.long)])
        def tried(examples: int) -> None:
            settings(max_examples=examples, deadline=None)(given(*strategies)(test))()

        tried.__name__, tried.__doc__ = test.__name__, test.__doc__
        tried.__module__, tried.__qualname__ = test.__module__, test.__qualname__
        return tried

    return of


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Name the seed at which a test has failed."""
    report = yield
    for value in getattr(item, "funcargs", {}).values() if report.failed else ():
        if isinstance(value, Seeds):
            report.sections.append(("seed", f"it failed at seed {value.now}"))
    return report


def pytest_report_header() -> str:
    """Which seeds are tried."""
    if SEED is None:
        return "random tests: fixed seeds"
    return f"random tests: seeds from {FIRST} on, of {VARIABLE}={TEXT}"


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """How what failed is repeated."""
    failed = terminalreporter.stats.get("failed", []) if TEXT else []
    if failed:
        terminalreporter.section("to repeat what failed")
    for report in failed:
        terminalreporter.write_line(f"{VARIABLE}={TEXT} .venv/bin/pytest '{report.nodeid}'")

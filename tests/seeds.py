"""Parameters of tests with many cases, of which most are long; and the seeds of random tests.

Seeds are fixed, or fresh: those follow from SPECC_SEED, which is any text. .ci/run takes the digest
of the tree that is tested. A seed that has failed joins the fixed ones of its test.

Each random test says how many fresh seeds .ci/run tries: so few that all tests together take less
than 120 CPU seconds on them, which `bench.suite_cost` prints. `make soak` tries SPECC_SEEDS of each
test, and begins no more of them when a test has taken SPECC_LIMIT_S seconds. What else takes too
long for .ci/run is marked `soak`.
"""

from __future__ import annotations

import os
from collections import defaultdict
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
COUNT = int(os.environ.get("SPECC_SEEDS") or 0)
"""Fresh seeds of each random test; as many as the test says where it is 0."""
LIMIT_S = float(os.environ.get("SPECC_LIMIT_S") or 0)
"""Of all workers together, after which a random test begins no more seeds; no end where it is 0."""
FRESH = (pytest.mark.long, pytest.mark.fresh)
SOAK = (pytest.mark.long, pytest.mark.soak)


class Seeds(Sequence[int]):
    """The seeds that one test tries; it knows which one was looked at last."""

    now: int | None = None
    tried = 0
    """How many were looked at."""

    def __init__(self, seeds: Iterable[int], *, are_fresh: bool = False) -> None:
        self._seeds = tuple(seeds)
        self.are_fresh = are_fresh
        """A few fresh seeds need not reach all that the fixed ones are chosen for."""

    def __len__(self) -> int:
        return len(self._seeds)

    def __getitem__(self, index: Any) -> Any:
        settle()
        self.now = self._seeds[index]
        self.tried = max(self.tried, index + 1)
        return self.now


def how_many(in_ci: int) -> int:
    """Fresh seeds, or examples of Hypothesis: those of .ci/run, or of a longer campaign."""
    return COUNT or in_ci


def blocks(fixed: Iterable[int], *, long: int, each: int, also: Iterable[int] = ()) -> list[Any]:
    """Parameters of a random test: the fixed seeds, and `long` fresh ones, `each` of a test.

    Long are those that are `also` fixed, too. Where `long` is 0 there are no fresh ones.
    """
    more, most = Seeds(also), how_many(long) if long else 0
    fresh = [range(FIRST + n, FIRST + min(n + each, most)) for n in range(0, most, each)]
    return [
        pytest.param(Seeds(fixed), id="fixed"),
        *([pytest.param(more, id="also fixed", marks=pytest.mark.long)] if len(more) else ()),
        *(
            pytest.param(Seeds(s, are_fresh=True), id=f"{s.start}-{s[-1]}", marks=FRESH)
            for s in fresh
        ),
    ]


def examples(few: int, many: int) -> list[Any]:
    """Parameters of a test whose `examples` Hypothesis draws: a few, or `many` in .ci/run."""
    return [few, pytest.param(how_many(many), marks=FRESH)]


def short(values: Iterable[Any], *places: int, in_ci: int = 1) -> list[Any]:
    """Parameters of which `make test` has those at the places, and the long tests all others.

    If `in_ci` is 3, the long tests have every third of the others, and `make soak` the rest.
    """
    found, others = [], 0
    for place, value in enumerate(values):
        marks: Any = ()
        if place not in places:
            marks = pytest.mark.long if others % in_ci == 0 else SOAK
            others += 1
        found.append(pytest.param(*(value if isinstance(value, tuple) else (value,)), marks=marks))
    return found


def every(count: int, values: Sequence[Any]) -> list[Any]:
    """Parameters of which `make test` has every so many, and the long tests all others."""
    return short(values, *range(0, len(values), count))


def drawn(*strategies: Any, few: int, many: int) -> Callable[[Callable[..., None]], Any]:
    """A random test whose arguments Hypothesis draws: a `few` examples, or `many` if it is long."""

    def of(test: Callable[..., None]) -> Any:
        @pytest.mark.parametrize("examples", examples(few, many))
        def tried(examples: int) -> None:
            settings(max_examples=examples, deadline=None)(given(*strategies)(test))()

        tried.__name__, tried.__doc__ = test.__name__, test.__doc__
        tried.__module__, tried.__qualname__ = test.__module__, test.__qualname__
        return tried

    return of


spent_s: dict[str, float] = defaultdict(float)
"""What this worker has spent on each random test."""
OF_A_WORKER_S = LIMIT_S / int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Begin no more seeds of a test that has taken its time."""
    if LIMIT_S and spent_s[without_parameters(item.nodeid)] > OF_A_WORKER_S:
        pytest.skip(f"the {LIMIT_S:g} s of this test are over")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Name the seed at which a test has failed, and count those that were tried."""
    report = yield
    if call.when != "call":
        return report
    spent_s[without_parameters(item.nodeid)] += call.duration
    given = list(getattr(item, "funcargs", {}).values())
    seeds = next((value for value in given if isinstance(value, Seeds)), None)
    if seeds is not None and report.failed:
        report.sections.append(("seed", f"it failed at seed {seeds.now}"))
    if item.get_closest_marker("fresh") or item.get_closest_marker("hypothesis"):
        drawn = item.callspec.params.get("examples") if hasattr(item, "callspec") else None
        tried = seeds.tried if seeds is not None else drawn or settings.default.max_examples
        failed = ("an example" if seeds is None else str(seeds.now)) if report.failed else ""
        report.user_properties.append(("fresh", (tried, failed)))
    return report


def pytest_report_header() -> str:
    """Which seeds are tried."""
    if SEED is None:
        return "random tests: fixed seeds"
    return f"random tests: seeds from {FIRST} on, of {VARIABLE}={TEXT}"


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """What was tried in a campaign, and how what failed is repeated."""
    stats = terminalreporter.stats
    if COUNT:
        terminalreporter.section(f"fresh seeds, {COUNT} of each random test")
        reports = [*stats.get("passed", ()), *stats.get("failed", ())]
        terminalreporter.write_line(campaign(reports))
    failed = stats.get("failed", []) if TEXT else []
    if failed:
        terminalreporter.section("to repeat what failed")
    count = f"SPECC_SEEDS={COUNT} " if COUNT else ""
    for report in failed:
        terminalreporter.write_line(f"{VARIABLE}={TEXT} {count}.venv/bin/pytest '{report.nodeid}'")


def campaign(reports: Iterable[pytest.TestReport]) -> str:
    """A line for each random test: how many seeds or examples were tried, and which failed."""
    tried, failed = defaultdict[str, int](int), defaultdict[str, list[str]](list)
    for report in reports:
        count, seed = dict(report.user_properties).get("fresh", (0, ""))
        name = without_parameters(report.nodeid)
        tried[name] += count
        failed[name] += [seed] if seed else []
    lines = [
        f"{tried[name]:7} tried, {', '.join(failed[name]) or 'none'} failed  {name}"
        for name in sorted(tried)
        if tried[name]
    ]
    return "\n".join([*lines, f"{sum(tried.values()):7} tried in all"])


def without_parameters(nodeid: str) -> str:
    """The name of a test function."""
    return nodeid.partition("[")[0]

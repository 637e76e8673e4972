"""What is said of a run that has ended."""

from __future__ import annotations

import shlex
from collections.abc import Iterator

from specc_runtime.options import Options
from specc_runtime.printing import say
from specc_runtime.report import Report

_MOST_MOMENTS = 3


def tell(report: Report, options: Options) -> None:
    """Print what happened, and where a recording says why."""
    if options.quiet:
        for fault in report.faults:
            say(f"fault: {fault['culprit']}: {fault['message']}")
        for requirement in report.requirements:
            if requirement["verdict"] == "violated":
                called = f"{requirement['name']}: " if "name" in requirement else ""
                what = "broken contract" if "contract" in requirement else "violated"
                because = requirement["because"] and f", because: {requirement['because']}"
                say(f"{what}: {called}{requirement['that']}{because}")
    else:
        from specc_runtime.progress.summary import show

        show(report)
    for name, last in report.last_outputs.items():
        if last["problem"]:
            got = f"got {last['value']} from {last['by']}" if last["by"] else "got nothing"
            say(f"safe output: {name} {got}: {last['problem']}")
    for words in list(_reasons(report, options))[:_MOST_MOMENTS]:
        say(f"why: {words}")


def _reasons(report: Report, options: Options) -> Iterator[str]:
    """Commands that look at the moments of faults and violations, if they were recorded."""
    if options.record is None or options.profile is not None or not options.spec:
        return
    violated = [r for r in report.requirements if r["verdict"] == "violated"]
    moments = [(fault["time_s"], fault["subsystem"]) for fault in report.faults]
    moments += [(r["time_s"], "") for r in violated if r["time_s"] is not None]
    for time_s, subsystem in dict.fromkeys(moments):
        moment = f"{options.record}@{round(time_s, 6):.12g}"
        command = ["specc", "why", moment, *filter(None, [subsystem]), "--spec", options.spec]
        yield shlex.join(command)

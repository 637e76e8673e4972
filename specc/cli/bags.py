"""`specc replay --bag`: what a specification does with what a bag of ROS 2 has of its topics."""

from __future__ import annotations

from argparse import Namespace
from math import isfinite

from specc.atomic_files import temporary_folder
from specc.cli import recordings, streams
from specc.cli.run import launch
from specc.refusal import Refused

_LONGEST_S = 1e9
"""No bag is longer."""


def replay(options: Namespace) -> int:
    """Replay a recording, or run a specification on a bag."""
    if options.bag is not None:
        return _replay_bag(options)
    if options.record or options.set or options.ros_args:
        raise Refused("--record, --set and --ros-args are for a --bag")
    return recordings.replay(options)


def _replay_bag(options: Namespace) -> int:
    """Run the specification on a bag; exit code 1 for a fault or a violated requirement."""
    from specc import pipeline

    if options.spec or options.subsystem or options.check:
        raise Refused("--spec, --subsystem and --check are for recordings, and not for a --bag")
    options.spec = options.file
    result = pipeline.compile_spec(options.spec, options.set)
    if not result.ok or result.system is None:
        return streams.print_findings(result, options.spec) or recordings.DIFFERS
    built = pipeline.generated(result, options.spec, is_read=False, tests_all_rows=True)
    if not built.files:
        return streams.print_findings(built.result, options.spec) or recordings.DIFFERS
    options.duration_s = options.until if isfinite(options.until) else _LONGEST_S
    options.quiet, options.resume = True, None
    with temporary_folder() as scratch:
        package = recordings.write_package(built, scratch / "generated")
        return launch(package, options, built.result.sources)

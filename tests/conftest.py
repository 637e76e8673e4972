"""Random tests draw the same examples in every run; signals reach what tests start."""

import signal

from hypothesis import HealthCheck, settings

# No test asserts a time: on a busy machine any example may be slow.
settings.register_profile(
    "same", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("same")

# A shell's background job ignores these, and so would every process that a test starts.
for number in (signal.SIGINT, signal.SIGHUP, signal.SIGQUIT):
    if signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(number, signal.SIG_DFL)

"""The process that holds the devices of a run in real time. It is started as a file, by its path:

    python .../specc_runtime/hosting/host.py CONTROL MEMORY ERRORS

with the descriptors of a socket to the agent, of the shared memory, and of the standard error that
people see. Any Python from 3.10 on will do, with its standard library only: all that this file
imports keeps to that. It loads `specc_runtime` from around itself, so the folder that this is
installed in is not searched for anything else.

The agent names the devices, `module:factory`; `specc_runtime.hosting.devices` says what they are.
The host writes what they measure into shared memory and hands them the agent's outputs.

What is promised, as far as the operating system gives this process time:

- When the agent ends in any way, SIGKILL included, every device with a last will gets it at once.
  When the agent has been silent for longer than the `silence` of a device that it has commanded,
  that device gets its will. From then on the agent's outputs for it are refused, until the agent
  says that the run is over.
- SIGINT, SIGTERM, SIGHUP and SIGQUIT are told to the agent, which may have got them as well and
  gives safe outputs itself. If it has not ended within `keeper.LEAVE_S`, the host gives the will.
- A device that raises, floods or hangs, in `poll` or in `send`, keeps neither the will nor the
  outputs of another one from being given: each has a thread of its own. A device whose own `send`
  hangs is sent its will all the same, from another thread, and once more when that `send` returns.
  An extension in C that never lets the interpreter go stops everything; all that the agent notices
  then is that there are no samples.
- Devices are closed, and the process ends, whatever they do, within `WILL_S` and `CLOSE_S` of
  `keeper`. Nothing stays behind: the memory has no name, and the end of the agent is noticed.
"""

import os
import socket
import sys
from contextlib import suppress
from importlib.util import module_from_spec, spec_from_file_location

_SWITCH_S = 1e-4
"""How long a thread that computes keeps the interpreter from one that has an output to send."""


def main() -> None:
    """Serve until the agent is gone. Ends the process without waiting for threads that hang."""
    if sys.version_info < (3, 10):  # noqa: UP036  # the user's Python may be any
        version = ".".join(map(str, sys.version_info[:2]))
        sys.exit("the device host needs Python 3.10 or later, this is " + version)
    control, memory, errors = map(int, sys.argv[1:4])
    _find_specc_runtime()
    from specc_runtime.hosting.keeper import Keeper
    from specc_runtime.hosting.wire import HostChannel

    sys.setswitchinterval(_SWITCH_S)
    Keeper(HostChannel(socket.socket(fileno=control)), memory, errors).run()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    os._exit(0)


def _find_specc_runtime() -> None:
    """Let `specc_runtime` be the package that this file is in, and nothing beside it be found."""
    here = os.path.dirname(os.path.abspath(__file__))
    sys.path[:] = [p for p in sys.path if os.path.realpath(p or ".") != os.path.realpath(here)]
    package = os.path.dirname(here)
    spec = spec_from_file_location(
        "specc_runtime",
        os.path.join(package, "__init__.py"),
        submodule_search_locations=[package],
    )
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    sys.modules["specc_runtime"] = module
    spec.loader.exec_module(module)


if __name__ == "__main__":
    main()

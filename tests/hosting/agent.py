"""A run in real time, in a process of its own: what it is to be killed or stopped in.

    python agent.py LOG [NAME=VALUE…]

It commands two devices every 2 ms, and says on standard output when it begins and how it ended.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

from specc_runtime.faults import Fault
from specc_runtime.plants.errors import PlantError

from tests.hosting.rig import plant, system

SILENCE_S = 0.04


def main() -> None:
    folder, *settings = sys.argv[1:]
    config = dict(setting.split("=", 1) for setting in settings)
    values = {"a.E.d.q": 1.0, "b.E.d.q": 2.0}
    fails = json.loads(config.get("fails", "{}"))
    built = system("a.E.d", "b.E.d", silence_s=float(config.get("silence", SILENCE_S)))
    hosted = plant(Path(folder), built, values=values, fails=fails)
    for device in ("a.E.d", "b.E.d"):
        hosted.bequeath(device, {f"{device}.u": [("safe", "safe")]})
    print(hosted._host._process.pid, flush=True)
    until_s = time.monotonic() + float(config.get("lasts", 30.0))
    try:
        while time.monotonic() < until_s:
            for device in ("a.E.d", "b.E.d"):
                hosted.sample(f"{device}.q")
                hosted.actuate(f"{device}.u", 1.0)
            hosted.advance(0.002)
            time.sleep(0.002)
    except (Fault, PlantError) as error:
        print(error, flush=True)
        for device in ("a.E.d", "b.E.d"):
            hosted.actuate(f"{device}.u", "late")
    time.sleep(float(config.get("pause", 0.0)))
    hosted.leave()
    for device in ("a.E.d", "b.E.d"):
        hosted.actuate(f"{device}.u", "left")
    hosted.close()
    print("over", flush=True)


if __name__ == "__main__":
    main()

"""A loss that a binding answers is a sample, and so is the return: runs, their replay and past."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.docs.examples import examples
from tests.recording.runs import ROOT, messages, report_of, specc
from tests.seeds import every

EXAMPLE = next(
    e.text for e in examples(ROOT / "docs" / "ros2.md") if "\nsystem: careful\n" in e.text
)
SCANNER = """\
from specc_runtime import LOST, NO_SAMPLE


class Scanner:
    def reset(self, seed):
        self.ticks = 0

    def sample(self, name):
        return 2.0 if self.ticks % 30 <= 10 else OTHERWISE

    def actuate(self, name, value):
        pass

    def advance(self, duration_s):
        self.ticks += 1

    def close(self):
        pass


def metres(raw):
    return float(raw[0])
"""
MODEL = """\
<mujoco>
  <worldbody>
    <body>
      <joint name="cart" type="slide" axis="1 0 0"/>
      <geom size="0.1"/>
    </body>
  </worldbody>
  <actuator><velocity joint="cart" name="motor"/></actuator>
  <sensor><jointpos joint="cart" name="way"/></sensor>
</mujoco>
"""
DUST = 'because: dust, at: "0.55[s]", every: "1.5[s]", lasts: "0.95[s]", silent: [base.R.scanner.d]'
PYTHON = "python: 'scanning:Scanner'", "", "sporadic: true", ""
MUJOCO = (
    "model: cart.xml",
    "actuators: [motor]",
    "sporadic: true, sensors: [way], through: 'scanning:metres'",
    f", disturb: [{{{DUST}}}]",
)
AGED = "max(aged, age(x.scanner.d)) if present(x.scanner.d) else aged"
SILENT = [(0.05, "fast"), (0.9, "slow"), (1.55, "fast"), (2.4, "slow"), (3.05, "fast")]
TOLD = [(0.05, "fast"), (0.6, "slow"), (1.55, "fast"), (2.1, "slow"), (3.05, "fast")]


def careful(folder: Path, plant: str, speed: str, range_: str, more: str) -> Path:
    """The example of the documentation; it notes how old what it reads is while it is slow."""
    text = EXAMPLE
    for old, new in (
        ("\n      let:", "\n      memory: {aged: {type: 'real[s]', init: 0}}\n      let:"),
        ("lost: not sees", "lost: present(x.scanner.d) and not sees"),
        ('0.05[m/s]"', f'0.05[m/s]", aged: "{AGED}"'),
        ("ros2: {node: careful}", plant),
        ("topic: /speed, type: std_msgs/Float64", speed),
        ("topic: /range, type: sensor_msgs/Range", range_),
        ("to: slow}", f"to: slow}}{more}"),
    ):
        assert old in text, old
        text = text.replace(old, new)
    (folder / "scanning.py").write_text(SCANNER, encoding="utf-8")
    (folder / "cart.xml").write_text(MODEL, encoding="utf-8")
    path = folder / "careful.yaml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.no_replay("replayed here")
@pytest.mark.parametrize(
    ("given", "otherwise", "changes"),
    every(3, [(PYTHON, "NO_SAMPLE", SILENT), (PYTHON, "LOST", TOLD), (MUJOCO, "", SILENT)]),
    ids=["python", "told", "mujoco"],
)
def test_losses_and_returns(
    given: tuple[str, str, str, str],
    otherwise: str,
    changes: list[tuple[float, str]],
    tmp_path: Path,
) -> None:
    spec, record = careful(tmp_path, *given), tmp_path / "run.mcap"
    module = tmp_path / "scanning.py"
    module.write_text(SCANNER.replace("OTHERWISE", otherwise or "None"), encoding="utf-8")
    run = ("run", spec, "--duration", 3.5, "--report")
    whole = specc(*run, tmp_path / "a.json", "--record", record, cwd=tmp_path)
    assert whole.returncode == 0, whole.stderr
    steps = [data for _, data in messages(record)["/base.c"]]
    seen = [(round(d["time"], 2), d["state"]) for d in steps if d["before"] not in ("", d["state"])]
    assert seen == changes
    replayed = specc("replay", record, "--spec", spec, "--check", cwd=tmp_path)
    assert replayed.returncode == 0 and "base.c: 70 steps are the same" in replayed.stdout
    for moment in (0.75, 1.2):  # silent, and lost
        past = (*run, tmp_path / "b.json", "--from", f"{record}@{moment}")
        assert specc(*past, cwd=tmp_path).returncode == 0
        assert report_of(tmp_path / "a.json") == report_of(tmp_path / "b.json"), moment
    # The value of a loss is as new as the step of the receptor that reads it.
    assert steps[-1]["memory"] == {"aged": pytest.approx(0.05)}

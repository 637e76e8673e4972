"""A changed safe output is a change of meaning."""

from __future__ import annotations

from pathlib import Path

from specc.cli import main
from tests.runtime.hinge import SPEC


def test_a_changed_safe_output_is_told(tmp_path: Path, capsys) -> None:
    old, new = tmp_path / "old.yaml", tmp_path / "new.yaml"
    (tmp_path / "hinge.xml").write_text("<mujoco/>")
    old.write_text(SPEC)
    new.write_text(SPEC.replace("7[N*m]", "8[N*m]").replace("is: hold(q)", "is: hold(2 * q)"))
    main(["diff", str(old), str(new)])
    told = capsys.readouterr().out
    assert "safe value" in told and "hold(2 * q)" in told
    assert "safe value if that fails" in told

"""What bench/handshake.py prints of specc is what SPIN says of the same machines."""

from __future__ import annotations

import pytest

from bench import handshake

FAILS = {"fewer"}


@pytest.mark.long
def test_specc_has_the_verdicts_of_spin() -> None:
    verdicts, _, _ = handshake.of_specc("handshake.yaml")
    assert len(verdicts) == 6
    for name, verdict in verdicts.items():
        assert handshake.VERDICTS[verdict] == ("fails" if name in FAILS else "holds"), name


@pytest.mark.long
def test_specc_finds_the_deadlock() -> None:
    verdicts, _, _ = handshake.of_specc("handshake_stuck.yaml")
    assert handshake.VERDICTS[verdicts[handshake.DEADLOCK]] == "fails"

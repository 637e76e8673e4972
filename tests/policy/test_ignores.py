"""Comments that hold findings back: what they do, and what is found wrong with them."""

from pathlib import Path

import pytest

from specc.pipeline import compile_spec
from specc.policy import Judgement, Settings, judge
from tests.policy.specs import write


def judged(path: Path, settings: Settings | None = None) -> Judgement:
    result = compile_spec(str(path))
    return judge(result.diagnostics, result.sources, settings or Settings())


def codes(verdict: Judgement) -> list[str]:
    return sorted(finding.code for finding in verdict.diagnostics)


def test_without_comments_there_are_two_warnings(tmp_path: Path) -> None:
    verdict = judged(write(tmp_path / "a.yaml"))
    assert codes(verdict) == ["W0611", "W0611"]
    assert verdict.ignored == 0


def test_a_comment_applies_to_its_own_line(tmp_path: Path) -> None:
    verdict = judged(write(tmp_path / "a.yaml", " # specc: ignore[W0611] for the next robot"))
    assert codes(verdict) == ["W0611"]
    assert verdict.ignored == 1


def test_a_comment_alone_applies_to_the_next_line_with_something(tmp_path: Path) -> None:
    comment = "\n      # specc: ignore[W0611] for later\n\n      # and another comment"
    verdict = judged(write(tmp_path / "a.yaml", comment))
    assert codes(verdict) == ["W0611"]
    assert verdict.ignored == 1


def test_a_comment_without_reason_has_no_effect(tmp_path: Path) -> None:
    verdict = judged(write(tmp_path / "a.yaml", " # specc: ignore[W0611]"))
    assert codes(verdict) == ["E0903", "W0611", "W0611"]
    assert verdict.refused


@pytest.mark.parametrize(
    "comment",
    [
        "ignroe[W0611] why",
        "ignore W0611",
        "ignore[W0999] why",
        "ignore[] why",
        f"ignore[{'W0611, ' * 21}] why",
        "",
    ],
)
def test_a_comment_that_says_nothing(comment: str, tmp_path: Path) -> None:
    verdict = judged(write(tmp_path / "a.yaml", f" # specc: {comment}"))
    assert codes(verdict) == ["E0903", "W0611", "W0611"]


@pytest.mark.parametrize(
    ("comment", "help"),
    [
        ("ignore W0611: for later", "write `# specc: ignore[W0611] for later`"),
        ("ignored", "write `# specc: ignore[W0412] reason`"),
        ("ignore[w0611] x", "did you mean `W0611`?"),
        ("ignore[W06] x", "a comment must name whole codes"),
        ("ignore[W0611] a # specc: ignore[W0604] b", "write `# specc: ignore[W0611, W0604] b`"),
    ],
)
def test_the_way_out_is_the_comment_that_was_meant(comment: str, help: str, tmp_path: Path) -> None:
    verdict = judged(write(tmp_path / "a.yaml", f" # specc: {comment}"))
    (found,) = [finding for finding in verdict.diagnostics if finding.code == "E0903"]
    assert found.help == help
    assert verdict.ignored == 0


def test_errors_cannot_be_ignored(tmp_path: Path) -> None:
    path = write(tmp_path / "a.yaml")
    text = path.read_text().replace("S0: work}", "S0: wrk} # specc: ignore[E0201] why not")
    path.write_text(text)
    assert {"E0201", "E0903"} <= set(codes(judged(path)))


def test_an_unused_comment_is_found_with_its_repair(tmp_path: Path) -> None:
    why = " # specc: ignore[W0611, W0414] because"
    verdict = judged(write(tmp_path / "a.yaml", why, why))
    assert codes(verdict) == ["W0901", "W0901"]
    assert all("W0414" in finding.message for finding in verdict.diagnostics)
    assert all(finding.fix is not None for finding in verdict.diagnostics)


def test_nothing_is_called_unused_while_there_are_errors(tmp_path: Path) -> None:
    path = write(tmp_path / "a.yaml", "", " # specc: ignore[W0414] because")
    assert "W0901" in codes(judged(path))
    path.write_text(path.read_text().replace("S0: work}", "S0: wrk}"))
    assert "W0901" not in codes(judged(path))


def test_strictness_promotes_what_is_left(tmp_path: Path) -> None:
    path = write(tmp_path / "a.yaml", " # specc: ignore[W0611] because")
    assert not judged(path).refused
    verdict = judged(path, Settings(strict=True))
    assert [finding.severity for finding in verdict.diagnostics] == ["error"]
    assert not judged(path, Settings(strict=True, ignore=("W06",))).diagnostics


def test_selection_never_hides_errors(tmp_path: Path) -> None:
    path = write(tmp_path / "a.yaml")
    assert codes(judged(path, Settings(select=("W04",)))) == []
    path.write_text(path.read_text().replace("S0: work}", "S0: wrk}"))
    assert "E0201" in codes(judged(path, Settings(select=("W04",), ignore=("W",))))

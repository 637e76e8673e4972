"""Golden packages: what `tests/golden/<name>.yaml` becomes, beside it in `<name>/`.

`python -m tests.emit.golden` writes them anew; read the difference like code before committing it.
"""

from __future__ import annotations

import shutil
from pathlib import Path

from specc.emit import emit
from specc.lower import lower
from specc.pipeline import compile_spec
from tests.lower.models import Known

GOLDEN = Path(__file__).resolve().parents[1] / "golden"
SPECS = sorted(path.stem for path in GOLDEN.glob("*.yaml"))


def packages(name: str) -> dict[str, dict[str, str]]:
    """Directory -> files: as the checks prove the tables, and as if they had proved nothing."""
    result = compile_spec(str(GOLDEN / f"{name}.yaml"))
    assert result.ok, [d.message for d in result.diagnostics]
    assert result.system is not None
    return {
        name: emit(lower(result.system, result.proofs)),
        f"{name}_checked": emit(lower(result.system, Known(False))),
    }


def main() -> None:
    """Write all golden packages."""
    for name in SPECS:
        for directory, files in packages(name).items():
            shutil.rmtree(GOLDEN / directory, ignore_errors=True)
            for path, text in files.items():
                file = GOLDEN / directory / path
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()

"""What happens to findings before they are shown: ignore comments, settings, strictness."""

from specc.policy.judge import Judged, judge
from specc.policy.settings import (
    Overrides,
    Settings,
    allowed_paths,
    forget,
    project_of,
    settings_for,
)

__all__ = [
    "Judged",
    "Overrides",
    "Settings",
    "allowed_paths",
    "forget",
    "judge",
    "project_of",
    "settings_for",
]

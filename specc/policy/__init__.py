"""What happens to findings before they are shown: ignore comments, settings, strictness."""

from specc.policy.judge import Judgement, judge
from specc.policy.settings import (
    Overrides,
    Settings,
    allowed_paths,
    clear_cache,
    project_of,
    settings_for,
)

__all__ = [
    "Judgement",
    "Overrides",
    "Settings",
    "allowed_paths",
    "clear_cache",
    "judge",
    "project_of",
    "settings_for",
]

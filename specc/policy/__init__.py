"""What happens to findings before they are shown: ignore comments, settings, strictness."""

from specc.policy.judge import Judged, judge
from specc.policy.settings import Overrides, Settings, forget, project_of, reach_of, settings_for

__all__ = [
    "Judged",
    "Overrides",
    "Settings",
    "forget",
    "judge",
    "project_of",
    "reach_of",
    "settings_for",
]

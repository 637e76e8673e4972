"""What happens to findings before they are shown: ignore comments, settings, strictness."""

from specc.policy.judge import Judged, judge
from specc.policy.settings import Overrides, Settings, settings_for

__all__ = ["Judged", "Overrides", "Settings", "judge", "settings_for"]

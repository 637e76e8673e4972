"""What happens to findings before they are shown: ignore comments, settings, strictness."""

from specc.policy.judge import Judged, judge
from specc.policy.settings import Overrides, Settings, forget, reach_of, settings_for

__all__ = ["Judged", "Overrides", "Settings", "forget", "judge", "reach_of", "settings_for"]

"""`python -m specc_runtime`."""

import sys

from specc_runtime import main
from specc_runtime.leftovers import leave

code = main.main()
if main.has_threads:
    leave(code)
sys.exit(code)

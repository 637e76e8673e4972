"""`python -m specc_runtime`."""

import sys

from specc_runtime.main import main

sys.exit(main())

"""Lets the tests of this folder import ``harness``, which importlib mode would not find by itself."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

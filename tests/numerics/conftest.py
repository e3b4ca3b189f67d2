"""Lets the tests of this folder use the scenario loop of the actors' tests."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "actors"))

"""Lets the tests of this folder import the scenario loop of the actors' tests, and ``robustness``."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1] / "actors"), str(Path(__file__).parent)]

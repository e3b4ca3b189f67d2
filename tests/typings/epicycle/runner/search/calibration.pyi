from runner.search.calibration import *

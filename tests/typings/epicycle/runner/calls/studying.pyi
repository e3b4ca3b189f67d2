from runner.calls.studying import *

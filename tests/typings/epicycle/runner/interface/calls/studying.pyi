from runner.interface.calls.studying import *

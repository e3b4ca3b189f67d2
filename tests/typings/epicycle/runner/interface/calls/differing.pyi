from runner.interface.calls.differing import *

from runner.interface.calls.what_if import *

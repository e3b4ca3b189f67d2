from runner.calls.what_if import *

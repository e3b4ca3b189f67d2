from runner.calls.differing import *

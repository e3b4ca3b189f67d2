from runner.calls.searching import *

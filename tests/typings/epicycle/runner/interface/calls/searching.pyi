from runner.interface.calls.searching import *

from runner.calls.running import *

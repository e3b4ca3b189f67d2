from runner.interface.calls.running import *

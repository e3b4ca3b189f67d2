from runner.interface.calls.recording import *

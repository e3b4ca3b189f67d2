from runner.calls.recording import *

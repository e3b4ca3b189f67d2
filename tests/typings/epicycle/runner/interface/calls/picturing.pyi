from runner.interface.calls.picturing import *

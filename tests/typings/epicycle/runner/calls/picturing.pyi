from runner.calls.picturing import *

from runner.calls import *

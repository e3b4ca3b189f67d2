from runner.interface.calls import *

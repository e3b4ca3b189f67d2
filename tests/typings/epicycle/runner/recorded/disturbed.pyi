from runner.recorded.disturbed import *

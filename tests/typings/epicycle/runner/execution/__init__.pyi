from runner.execution import *

from runner.execution.engine import *

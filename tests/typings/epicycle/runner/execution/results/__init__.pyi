from runner.execution.results import *

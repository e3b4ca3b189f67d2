from runner.engine import *

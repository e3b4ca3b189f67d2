from runner.graph import *

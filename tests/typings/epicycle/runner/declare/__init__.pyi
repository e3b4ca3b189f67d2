from runner.declare import *

from runner.support.declare import *

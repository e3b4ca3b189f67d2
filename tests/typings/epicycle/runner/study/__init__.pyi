from runner.study import *

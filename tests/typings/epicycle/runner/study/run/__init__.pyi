from runner.study.run import *

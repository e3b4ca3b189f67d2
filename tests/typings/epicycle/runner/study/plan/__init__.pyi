from runner.study.plan import *

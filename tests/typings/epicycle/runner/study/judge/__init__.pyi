from runner.study.judge import *

from runner.temporal import *

from runner.model.temporal import *

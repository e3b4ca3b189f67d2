from runner.build import *

from runner.model.build import *

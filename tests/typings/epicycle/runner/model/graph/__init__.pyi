from runner.model.graph import *

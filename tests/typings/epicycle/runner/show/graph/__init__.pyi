from runner.show.graph import *

from runner.search.falsification import *

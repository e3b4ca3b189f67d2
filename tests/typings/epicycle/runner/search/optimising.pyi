from runner.search.optimising import *

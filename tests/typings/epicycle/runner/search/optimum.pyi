from runner.search.optimum import *

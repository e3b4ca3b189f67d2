from runner.search.explanation import *

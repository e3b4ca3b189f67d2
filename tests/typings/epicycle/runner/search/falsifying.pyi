from runner.search.falsifying import *

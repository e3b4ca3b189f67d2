from runner.search.future import *

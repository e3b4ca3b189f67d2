from runner.search.spec import *

from runner.search.comparing import *

from runner.search.what_if import *

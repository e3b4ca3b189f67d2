from runner.search import *

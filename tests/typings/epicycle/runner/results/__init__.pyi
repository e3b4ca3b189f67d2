from runner.results import *

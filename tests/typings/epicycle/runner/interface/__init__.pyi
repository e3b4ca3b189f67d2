from runner.interface import *

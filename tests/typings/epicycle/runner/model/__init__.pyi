from runner.model import *

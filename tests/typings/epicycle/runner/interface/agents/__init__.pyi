from runner.interface.agents import *

from runner.agents import *

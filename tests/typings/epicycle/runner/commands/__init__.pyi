from runner.commands import *

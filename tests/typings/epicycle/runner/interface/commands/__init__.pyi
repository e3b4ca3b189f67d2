from runner.interface.commands import *

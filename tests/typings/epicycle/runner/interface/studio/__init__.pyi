from runner.interface.studio import *

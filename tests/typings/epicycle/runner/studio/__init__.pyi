from runner.studio import *

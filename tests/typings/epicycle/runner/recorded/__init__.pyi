from runner.recorded import *

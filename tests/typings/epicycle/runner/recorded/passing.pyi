from runner.recorded.passing import *

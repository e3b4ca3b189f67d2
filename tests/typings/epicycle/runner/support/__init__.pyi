from runner.support import *

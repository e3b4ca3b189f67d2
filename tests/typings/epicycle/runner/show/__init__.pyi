from runner.show import *

from runner.recorded.channel import *

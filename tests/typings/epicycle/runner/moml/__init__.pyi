from runner.moml import *

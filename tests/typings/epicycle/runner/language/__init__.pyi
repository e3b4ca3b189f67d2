from runner.language import *

from runner.text import *

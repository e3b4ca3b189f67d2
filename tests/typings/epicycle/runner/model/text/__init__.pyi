from runner.model.text import *

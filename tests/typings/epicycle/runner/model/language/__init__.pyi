from runner.model.language import *

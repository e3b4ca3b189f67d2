from runner.show.report import *

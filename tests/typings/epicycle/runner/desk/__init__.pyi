from runner.desk import *

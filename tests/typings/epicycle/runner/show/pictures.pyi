from runner.show.pictures import *

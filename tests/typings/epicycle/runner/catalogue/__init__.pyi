from runner.catalogue import *

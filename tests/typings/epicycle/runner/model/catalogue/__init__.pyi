from runner.model.catalogue import *

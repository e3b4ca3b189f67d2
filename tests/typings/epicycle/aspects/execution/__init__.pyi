from aspects.execution import *

from aspects.communication import *

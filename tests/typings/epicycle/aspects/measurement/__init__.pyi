from aspects.measurement import *

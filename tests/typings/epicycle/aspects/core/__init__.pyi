from aspects.core import *

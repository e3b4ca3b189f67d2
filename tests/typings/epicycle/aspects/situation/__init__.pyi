from aspects.situation import *

from actors.robotics.numerics import *

from actors.robotics import *

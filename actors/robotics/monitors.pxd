# Types for C; what everything is for is said in monitors.py.

from epicycle.actors.robotics.arrays cimport pair

# Types for C; what everything is for is said in messages.py.

from epicycle.actors.robotics.arrays cimport finite, read_only

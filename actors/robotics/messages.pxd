# Types for C; messages.py documents everything.

from epicycle.actors.robotics.arrays cimport finite, read_only

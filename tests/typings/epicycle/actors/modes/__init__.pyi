from actors.modes import *

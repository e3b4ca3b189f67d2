from actors.resources import *

from actors.expression import *

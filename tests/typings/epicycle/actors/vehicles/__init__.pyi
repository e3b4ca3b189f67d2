from actors.vehicles import *

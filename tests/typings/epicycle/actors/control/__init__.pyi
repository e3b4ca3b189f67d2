from actors.control import *

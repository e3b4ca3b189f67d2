from actors.core import *

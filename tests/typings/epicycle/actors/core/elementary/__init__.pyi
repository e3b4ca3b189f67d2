from actors.core.elementary import *

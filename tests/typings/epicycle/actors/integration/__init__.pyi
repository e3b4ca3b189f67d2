from actors.integration import *

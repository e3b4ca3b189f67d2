from aspects.media import *

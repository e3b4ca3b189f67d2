from runner.show.view import *

from runner.show.view.pages import *

from runner.search.splitting import *

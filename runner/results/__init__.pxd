from epicycle.runner.results.log cimport EventLog, Writer
from epicycle.runner.results.samples cimport Samples

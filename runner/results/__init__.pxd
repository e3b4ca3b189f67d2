from epicycle.runner.results.log cimport EventLog, Writer
from epicycle.runner.results.record cimport Samples

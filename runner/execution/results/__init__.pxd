from epicycle.runner.execution.results.log cimport EventLog, Writer
from epicycle.runner.execution.results.record cimport Samples

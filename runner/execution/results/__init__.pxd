from epicycle.runner.execution.results.record cimport Samples, Writer

from epicycle.runner.results.log cimport EventLog, Writer

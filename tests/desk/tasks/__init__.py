"""Modelling tasks in words, with hidden checks that judge a model: a measure of assistants.

``python -m tests.desk.tasks`` prints the tasks; ``python -m tests.desk.tasks FOLDER`` judges the models in a folder,
``FOLDER/NAME.yaml`` for each task.  An assistant sees the words alone: the checks, the reference solution and a wrong
one stand in the file of the task.
"""

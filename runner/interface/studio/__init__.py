"""The studio: a model in the browser, as text, graph and run; the text is the only source.

``server`` serves one page and one socket, and thinks nothing: it hands questions to two processes (``workers``), of
which one reads the text and the other makes runs (``worker``).  A process that dies or takes too long is replaced.
"""

"""The studio: a model in the browser, as text, graph and run; the text is the only source.

``server`` serves one page and one socket, and thinks nothing: it hands questions to three processes (``worker``) that
read the text, make runs, and make the futures of what if.  One that dies or takes too long is replaced.
"""

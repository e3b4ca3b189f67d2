"""The site: `make docs` builds it, see mkdocs.yml; and `python -m website.pictures` makes the README's picture anew."""

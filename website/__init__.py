"""The site: `make docs` builds it, see mkdocs.yml; `python -m website.pictures` renews the README's picture."""

"""A page that shows a run, or two side by side: what is recorded, how it is packed, and the program that shows it."""

from .page import ViewError, page, write_page
from .recording import Recording

__all__ = ["Recording", "ViewError", "page", "write_page"]

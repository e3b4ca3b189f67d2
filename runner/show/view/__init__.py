"""Files that show a run: a page, for one or two side by side, and recordings for other viewers."""

"""The frozen model: actors, composites, ports and connections, aspects at their places, what is watched, and ranks."""

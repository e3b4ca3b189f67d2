"""The root of all errors that Epicycle raises on purpose."""


class EpicycleError(Exception):
    """An error whose message is meant for the person at the keyboard."""

"""Numbers with their nouns, for messages and summaries."""


def counted(number: int, noun: str) -> str:
    """Return a number with what it counts: `0 ports`, `1 port`, `2,000 ports`."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"

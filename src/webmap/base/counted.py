"""Counts in sentences."""


def counted(number: int, thing: str) -> str:
    """Return a count with its noun, such as "1 robot" and "2 robots".

    Args:
        number: How many there are.
        thing: The noun in the singular; its plural ends in "s".

    """
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"

"""So many of something, in words that fit one of it too."""

__all__ = ["counted"]


def counted(count: int, one: str, several: str = "") -> str:
    """The count and what is counted: 1 view, 2 views.

    Parameters
    ----------
    count : int
    one : str
        What one is called, maybe with what it does: ``view has``.
    several : str
        What others are called; by default with an s at the end.
    """
    return f"{count} {one if count == 1 else several or one + 's'}"

"""Names and values as they may stand in a message: on one line, and no longer than people read."""

LONGEST_LINE = 720
# Of a line that is too long: how much of its beginning and of its end is kept.
HEAD, TAIL = 400, 300


def one_line(text: str) -> str:
    """Give a message on one line: what a terminal would obey is written out, a long middle cut.

    Parameters
    ----------
    text : str
        Message with names and values of files that anybody may have written.

    Returns
    -------
    str
        Printable characters alone.
    """
    plain = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
    if len(plain) <= LONGEST_LINE:
        return plain
    return f"{plain[:HEAD]} ... {plain[-TAIL:]}"

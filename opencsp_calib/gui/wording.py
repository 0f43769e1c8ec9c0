"""What the command line calls its options, said in the words of the page.

Messages come from functions that both faces share, and tell what to add by the option's name.
"""

import re

__all__ = ["worded"]

WORDS = {
    "`opencsp-calib formats` lists them": "the tab About lists them",
    "--fit MODEL of convert": "a fit, chosen as lens model under Convert,",
    "--fit": "the lens models under Convert",
    "--accept-error": '"Accepted error of a fit in px"',
    "--to": '"Format" under Convert',
    "--from": '"Format" under "Where the file does not tell"',
    "--camera": '"Which of several cameras"',
    "--image-size WIDTHxHEIGHT": '"Image size" under "Where the file does not tell"',
    "--image-size": '"Image size"',
    "--device": '"Camera (serial number) or folder"',
    "--set": 'in "Camera settings"',
    "--board SPEC": "describe it under Calibrate",
}
ANY = re.compile(rf"(?<![\w-])({'|'.join(map(re.escape, sorted(WORDS, key=len, reverse=True)))})(?![\w-])")


def worded(message: str) -> str:
    """A message of a shared function, with the page's names of fields in the place of the command line's options."""
    return ANY.sub(lambda found: WORDS[found[0]], message)

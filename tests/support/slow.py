"""batch -> sums, late.  Fresh processes import it: a batch that outlasts their patience."""

import sys
import time

from penumbra.core import render

_sample = sys.modules[render.__module__]._sample
SECONDS = 2.5  # of work before each batch


def sample(*of):
    """Work for nothing, then sample a batch."""
    end = time.process_time() + SECONDS
    while time.process_time() < end:
        pass
    return _sample(*of)
